#include "daemon/campaign/bench_pace.hpp"

#include <algorithm>

namespace weft::daemon {

std::chrono::nanoseconds PaceKeeper::ahead(TimePoint bench, std::chrono::nanoseconds wall) {
  constexpr std::chrono::milliseconds most_behind{100};
  const double pace = requested();
  if (pace == 0 || pace != pace_) since_.reset();
  pace_ = pace;
  if (pace == 0) return {};
  if (!since_) since_ = Since{bench, wall};
  const std::chrono::duration<double, std::nano> passed = bench - since_->bench;
  const auto due =
      since_->wall + std::chrono::duration_cast<std::chrono::nanoseconds>(passed / pace);
  if (wall - due > most_behind) since_ = Since{bench, wall};
  return std::max(due - wall, std::chrono::nanoseconds{});
}

}  // namespace weft::daemon
