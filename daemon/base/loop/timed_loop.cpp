#include "daemon/base/loop/timed_loop.hpp"

#include <utility>

#include "daemon/base/loop/wall_clock.hpp"

namespace weft::daemon {

TimerId TimedLoop::at(TimePoint when, Callback callback) {
  if (++count_ % stride != 0) return inner_->at(when, std::move(callback));
  return inner_->at(when, [this, callback = std::move(callback)] {
    const auto begin = steady_wall_now();
    callback();
    spent_ += stride * (steady_wall_now() - begin);
  });
}

}  // namespace weft::daemon
