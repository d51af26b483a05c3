#pragma once
// When a run will be over, and when it needs a person: the forecast of its plan, corrected by the
// trials done, by the people who worked, and by the pace of the bench.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "recipes/engine/engine.hpp"
#include "recipes/engine/operator_steps.hpp"

namespace weft::daemon {

/// Bench seconds are seconds of the bench's clock; people's time passes at its own pace.
struct PlannedTime {
  std::size_t trials = 0;  ///< of the whole plan
  std::size_t first = 0;   ///< the trial that the run begins with
  double trial_s = 0;      ///< each, by the mean of the forecast [bench s]
  double finally_s = 0;    ///< after the last one [bench s]
  double people_s = 0;     ///< of all operator steps from `first` on [s]
  /// The bench's clock is the world's; else its pace is that of the simulation.
  bool is_real_time = false;

  static PlannedTime of(const recipes::Plan& plan, std::size_t first, bool is_real_time);
};

/// A value; pure, with the monotonic time as an argument. `pace`: what is asked of a simulated
/// bench [bench s / s]; 0: as fast as it can.
class RunForecast {
 public:
  using Clock = std::chrono::nanoseconds;

  RunForecast() = default;
  explicit RunForecast(const PlannedTime& plan)
      : plan_(plan), done_(plan.first), people_left_s_(plan.people_s) {}

  /// The engine is in this step, at `bench_s` of the bench's clock; call at each change.
  void on_step(recipes::Step step, double bench_s, double pace, Clock now);
  /// So many trials are over: the run's own and those before `PlannedTime::first`.
  void on_trial(std::size_t done, double bench_s, double pace, Clock now);
  /// A person has done what was asked.
  void on_confirmed(const recipes::StepPrompt& prompt);
  /// It was done in another life of the campaign.
  void skip_prompt(const recipes::StepPrompt& prompt);

  /// Until the run is over [s]; nothing where the bench goes as fast as it can and no trial has
  /// ended at that pace yet.
  [[nodiscard]] std::optional<double> left_s(double pace, Clock now) const;
  /// Until the trial under way is over [s]; likewise.
  [[nodiscard]] std::optional<double> trial_left_s(double pace, Clock now) const;
  /// Until a later trial begins, without people's time [s]; nothing also where the run has not
  /// begun, is held, or waits for a person.
  [[nodiscard]] std::optional<double> left_until_s(std::size_t trial, double pace, Clock now) const;

 private:
  enum class Doing : std::uint8_t { nothing, moving, waiting, with_people };

  void advance(double bench_s, double pace, Clock now);
  [[nodiscard]] std::optional<double> speed(double pace) const;
  [[nodiscard]] double trial_s() const;
  [[nodiscard]] double used_s(double speed, Clock now) const;

  PlannedTime plan_;
  std::size_t done_ = 0;
  Doing doing_ = Doing::nothing;
  Clock at_{};                                  ///< of the newest report
  double bench_at_s_ = 0, pace_ = 0;            ///< likewise
  double trials_s_ = 0;                         ///< of the trials done [bench s]
  double used_s_ = 0, used_wall_s_ = 0;         ///< of the one under way [bench s], [s]
  double paced_s_ = 0, paced_wall_s_ = 0;       ///< of the trials done at `pace_` alone
  bool has_one_pace_ = true;                    ///< the trial under way, so far
  double people_left_s_ = 0;                    ///< by the recipe
  double people_s_ = 0, people_planned_s_ = 0;  ///< that people took so far, and by the recipe
};

}  // namespace weft::daemon
