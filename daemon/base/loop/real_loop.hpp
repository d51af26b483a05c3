#pragma once
// Real time: the monotonic clock, timers and ports on one thread.

#include <functional>
#include <memory>

#include "daemon/base/loop/timed_loop.hpp"

namespace asio {
class io_context;
}

namespace weft::daemon {

/// A loop on the computer's monotonic clock, zero at construction. Thread-bound.
class RealLoop final : public Loop {
 public:
  RealLoop();
  ~RealLoop() override;
  RealLoop(const RealLoop&) = delete;
  RealLoop& operator=(const RealLoop&) = delete;

  [[nodiscard]] TimePoint now() const override;
  TimerId at(TimePoint when, Callback callback) override;
  void cancel(TimerId id) override;

  /// Runs until `done()` is true. Checks it after each callback and at least every `longest_wait`,
  /// so that a flag set by a signal handler is seen. Serves ready ports before due timers: a
  /// control cycle sees the data that have arrived.
  void run_until(const std::function<bool()>& done);
  static constexpr Duration longest_wait = std::chrono::milliseconds(50);

  /// The context in which ports wait for bytes. For links.
  asio::io_context& ports();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon
