#pragma once
// Forecast of the end of a run and of its next operator step: from its plan, corrected by the
// trials done, the people's time and the simulation speed.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "recipes/engine/engine.hpp"
#include "recipes/engine/operator_steps.hpp"

namespace weft::daemon {

/// Bench seconds are seconds of the bench's clock; people's time passes in wall time.
struct PlannedTime {
  std::size_t trials = 0;  ///< of the whole plan
  std::size_t first = 0;   ///< first trial of the run
  double trial_s = 0;      ///< mean of the forecast, each [bench s]
  double finally_s = 0;    ///< after the last trial [bench s]
  double people_s = 0;     ///< of all operator steps from `first` on [s]
  /// True if the bench's clock is real time; otherwise the simulation speed applies.
  bool is_real_time = false;

  static PlannedTime of(const recipes::Plan& plan, std::size_t first, bool is_real_time);
};

/// A value; pure, with the monotonic time as an argument. `pace`: requested simulation speed [bench
/// s / s]; 0: as fast as possible.
class RunForecast {
 public:
  using Clock = std::chrono::nanoseconds;

  RunForecast() = default;
  explicit RunForecast(const PlannedTime& plan)
      : plan_(plan), done_(plan.first), people_left_s_(plan.people_s) {}

  /// The engine is in this step, at `bench_s` of the bench's clock; call at each change.
  void on_step(recipes::Step step, double bench_s, double pace, Clock now);
  /// `done` trials are over: the run's own and those before `PlannedTime::first`.
  void on_trial(std::size_t done, double bench_s, double pace, Clock now);
  /// A person has confirmed the step.
  void on_confirmed(const recipes::StepPrompt& prompt);
  /// The step was done in an earlier process of the campaign.
  void skip_prompt(const recipes::StepPrompt& prompt);

  /// Time until the run is over [s]. Nothing if the bench runs as fast as possible and no trial has
  /// ended at that speed yet.
  [[nodiscard]] std::optional<double> left_s(double pace, Clock now) const;
  /// Time until the current trial is over [s]; nothing as for left_s().
  [[nodiscard]] std::optional<double> trial_left_s(double pace, Clock now) const;
  /// Time until a later trial begins, without people's time [s]. Nothing as for left_s(), and if
  /// the run has not begun, is held, or waits for a person.
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
  Clock at_{};                             ///< of the newest report
  double bench_at_s_ = 0, pace_ = 0;       ///< at the newest report
  double trials_s_ = 0;                    ///< of the trials done [bench s]
  double used_s_ = 0, used_wall_s_ = 0;    ///< of the current trial [bench s], [s]
  double paced_s_ = 0, paced_wall_s_ = 0;  ///< of the trials done at `pace_` only
  bool has_one_pace_ = true;               ///< of the current trial so far
  double people_left_s_ = 0;               ///< from the recipe
  /// Taken by people so far, and planned for it by the recipe.
  double people_s_ = 0, people_planned_s_ = 0;
};

}  // namespace weft::daemon
