#pragma once
// The one source of time and timers. Two implementations live in daemon/base/loop: real (Asio) and
// virtual (ordered timers; when idle, jump to the next).

#include <cstdint>
#include <functional>

#include "protocols/base/time.hpp"

namespace weft {

using TimerId = std::uint64_t;

/// Thread-bound: every call and every callback happens on the loop's own thread.
class Loop {
 public:
  using Callback = std::function<void()>;

  virtual ~Loop() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  /// Runs `callback` once at `when` (at once, after what is queued, when that is past).
  /// Callbacks due at the same instant run in the order in which they were asked for.
  virtual TimerId at(TimePoint when, Callback callback) = 0;
  /// Forgets a timer; an id that already ran or never existed is ignored.
  virtual void cancel(TimerId id) = 0;

  TimerId after(Duration delay, Callback callback) {
    return at(now() + delay, std::move(callback));
  }
};

}  // namespace weft
