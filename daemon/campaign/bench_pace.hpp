#pragma once
// Simulation speed: makes a simulated bench slow enough to watch.

#include <atomic>
#include <chrono>
#include <optional>

#include "protocols/base/time.hpp"

namespace weft::daemon {

/// Bench seconds per wall second; 0: as fast as possible. Set from any thread.
using BenchPace = std::atomic<double>;
inline constexpr double slowest_pace = 1;  ///< deadlines of a run are in real time
inline constexpr double fastest_pace = 1e6;
/// 0 (as fast as possible), or a speed between the two.
constexpr bool is_pace(double times) {
  return times == 0 || (times >= slowest_pace && times <= fastest_pace);
}

/// Used by one run. A bench that fell behind (it was held, or is too slow) does not catch up.
class PaceKeeper {
 public:
  /// `requested` outlives it; null: as fast as possible.
  explicit PaceKeeper(const BenchPace* requested) : requested_(requested) {}

  /// Lead of the bench over its speed, which is the time to wait; zero or more.
  std::chrono::nanoseconds ahead(TimePoint bench, std::chrono::nanoseconds wall);
  /// The speed that is requested now.
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
