#include "daemon/campaign/bench_pace.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

constexpr std::chrono::nanoseconds most_behind = std::chrono::milliseconds(100);

}  // namespace

std::chrono::nanoseconds PaceKeeper::ahead(TimePoint bench, std::chrono::nanoseconds wall) {
  const double asked = asked_ == nullptr ? 0 : asked_->load(std::memory_order_relaxed);
  if (asked == 0 || asked != pace_) since_.reset();
  pace_ = asked;
  if (asked == 0) return {};
  if (!since_) since_ = Since{bench, wall};
  const std::chrono::duration<double, std::nano> passed = bench - since_->bench;
  const auto due =
      since_->wall + std::chrono::duration_cast<std::chrono::nanoseconds>(passed / asked);
  if (wall - due > most_behind) since_ = Since{bench, wall};
  return std::max(due - wall, std::chrono::nanoseconds{});
}

}  // namespace weft::daemon
