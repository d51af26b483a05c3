#pragma once
// When a run will be over: the forecast of its plan, corrected by the trials done and by the pace
// of the bench. Pure, with the monotonic time as an argument.

#include <chrono>
#include <cstddef>
#include <optional>

namespace weft::daemon::runs {

/// Bench seconds are seconds of the machine; people's time passes at its own pace.
struct PlannedTime {
  double trials_s = 0;   ///< of all trials [bench s]
  double finally_s = 0;  ///< after the last one [bench s]
  double people_s = 0;   ///< of all operator steps [s]
  std::size_t trials = 0;
};

class RunForecast {
 public:
  using Clock = std::chrono::nanoseconds;

  RunForecast() = default;
  explicit RunForecast(const PlannedTime& plan) : plan_(plan) {}

  /// The run is in its first step, at `bench_s` of the bench's clock.
  void on_begun(double bench_s, Clock now);
  /// `done` trials are over. `pace`: bench seconds per second; 0: as fast as the machine can.
  void on_trial(std::size_t done, double bench_s, double pace, Clock now);
  /// Between `pausing` and `running` no time of the bench is used up.
  void on_held(bool is_held, Clock now);
  /// Until the run is over [s]; nothing where the bench goes as fast as it can and no trial has
  /// ended at that pace yet.
  [[nodiscard]] std::optional<double> left_s(double pace, Clock now) const;

 private:
  PlannedTime plan_;
  std::size_t done_ = 0;
  double bench_began_s_ = 0, bench_s_ = 0;
  double pace_ = 0;   ///< of the newest trial
  double speed_ = 0;  ///< measured in the newest trial [bench s / s]; 0: not known
  Clock at_{};        ///< of the newest trial's end, less the time held since
  std::optional<Clock> held_at_;
  bool has_begun_ = false;
};

}  // namespace weft::daemon::runs
