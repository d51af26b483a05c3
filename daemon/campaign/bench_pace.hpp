#pragma once
// How fast the time of a simulated bench passes, so that people can watch it.

#include <atomic>
#include <chrono>
#include <optional>

#include "protocols/base/time.hpp"

namespace weft::daemon {

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
  /// What is requested now.
  [[nodiscard]] double requested() const {
    return requested_ == nullptr ? 0 : requested_->load(std::memory_order_relaxed);
  }

 private:
  struct Since {
    TimePoint bench;
    std::chrono::nanoseconds wall;
  };

  const BenchPace* requested_;
  double pace_ = 0;
  std::optional<Since> since_;
};

}  // namespace weft::daemon
