#include "daemon/campaign/bench_pace.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

constexpr std::chrono::nanoseconds most_behind = std::chrono::milliseconds(100);

}  // namespace

std::chrono::nanoseconds PaceKeeper::ahead(TimePoint bench, std::chrono::nanoseconds wall) {
  const double requested = requested_ == nullptr ? 0 : requested_->load(std::memory_order_relaxed);
  if (requested == 0 || requested != pace_) since_.reset();
  pace_ = requested;
  if (requested == 0) return {};
  if (!since_) since_ = Since{bench, wall};
  const std::chrono::duration<double, std::nano> passed = bench - since_->bench;
  const auto due =
      since_->wall + std::chrono::duration_cast<std::chrono::nanoseconds>(passed / requested);
  if (wall - due > most_behind) since_ = Since{bench, wall};
  return std::max(due - wall, std::chrono::nanoseconds{});
}

}  // namespace weft::daemon
