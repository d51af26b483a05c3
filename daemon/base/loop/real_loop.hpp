#pragma once
// Real time: the monotonic clock, timers and ports on one thread.

#include <functional>
#include <memory>

#include "daemon/base/loop/timed_loop.hpp"

namespace asio {
class io_context;
}

namespace weft::daemon {

/// A loop on the machine's monotonic clock; zero when the loop is made. Thread-bound.
class RealLoop final : public Loop {
 public:
  RealLoop();
  ~RealLoop() override;
  RealLoop(const RealLoop&) = delete;
  RealLoop& operator=(const RealLoop&) = delete;

  [[nodiscard]] TimePoint now() const override;
  TimerId at(TimePoint when, Callback callback) override;
  void cancel(TimerId id) override;

  /// Runs until `done()` is true, looked at after each callback and at least every
  /// `longest_wait`, so that a flag set by a signal handler is seen. Ports that are ready are
  /// served before a timer that is due: a control cycle sees what has arrived.
  void run_until(const std::function<bool()>& done);
  static constexpr Duration longest_wait = std::chrono::milliseconds(50);

  /// Where ports wait for their bytes. For links.
  asio::io_context& ports();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon
