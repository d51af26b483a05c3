#pragma once
// How fast a run gets on, machine and people apart: the time that is left, and when somebody is
// needed next.

#include <atomic>
#include <chrono>
#include <optional>

#include "protocols/base/time.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {

// How fast the time of a simulated bench passes, so that people can watch it.

/// Bench seconds per second of wall time; 0: as fast as it can. Set from any thread.
using BenchPace = std::atomic<double>;
inline constexpr double slowest_pace = 1;  ///< deadlines of a run are of real time
inline constexpr double fastest_pace = 1e6;
/// As fast as it can, or a pace between the two.
constexpr bool is_pace(double times) {
  return times == 0 || (times >= slowest_pace && times <= fastest_pace);
}

/// One run's side. A bench that fell behind (it was held, or cannot go so fast) does not catch up.
class PaceKeeper {
 public:
  /// `requested` outlives it; null: as fast as it can.
  explicit PaceKeeper(const BenchPace* requested) : requested_(requested) {}

  /// How far the bench is ahead of its pace, and so how long it ought to wait; zero or more.
  std::chrono::nanoseconds ahead(TimePoint bench, std::chrono::nanoseconds wall);

 private:
  struct Since {
    TimePoint bench;
    std::chrono::nanoseconds wall;
  };

  const BenchPace* requested_;
  double pace_ = 0;
  std::optional<Since> since_;
};

/// Wall times are from one monotonic clock, any origin. The plan outlives it.
class RunPace {
 public:
  using Clock = std::chrono::nanoseconds;
  /// `runs_in_real_time`: the bench takes as long as the forecast says, which a simulated one does
  /// not.
  RunPace(const recipes::Plan& plan, std::size_t first_trial, bool runs_in_real_time, Clock begun);

  /// The engine is in this step; call at each change.
  void step(const recipes::State& state, Clock now);
  /// A person has confirmed.
  void confirmed(const recipes::StepPrompt& prompt);
  /// It was confirmed in another life of the campaign.
  void skip_prompt(const recipes::StepPrompt& prompt);
  void trial_ended(std::size_t done) { done_ = done; }

  /// Of the trials that are not done yet, of the people that they need, and of what is done finally
  /// after a success where the bench keeps time [s].
  [[nodiscard]] double left_s(Clock now) const;
  /// The next ask before a trial from `from` on, which never falls; nothing where none is left.
  [[nodiscard]] const std::optional<recipes::StepPrompt>& next_prompt(std::size_t from);
  /// How long the machine takes until that [s]; nothing as long as it cannot be told.
  [[nodiscard]] std::optional<double> machine_until_s(std::size_t from, std::size_t to,
                                                      Clock now) const;

 private:
  [[nodiscard]] std::optional<double> trial_s(Clock now) const;

  const recipes::Plan* plan_;
  std::size_t first_, done_;
  bool runs_in_real_time_;
  Clock begun_;
  Clock idle_{};                ///< held or with people so far
  std::optional<Clock> since_;  ///< it stands, or somebody works
  bool for_people_ = false;     ///< so it does for people
  double people_left_s_ = 0;    ///< by the recipe
  double worked_s_ = 0;         ///< people, so far
  double estimated_s_ = 0;      ///< what the recipe says of that
  bool has_next_ = false;
  std::optional<recipes::StepPrompt> next_;
};

}  // namespace weft::daemon
