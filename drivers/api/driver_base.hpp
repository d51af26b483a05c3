#pragma once
// What every driver does alike: the lifecycle, the link's callbacks, the way into a fault.

#include <string_view>

#include "drivers/api/driver.hpp"
#include "drivers/api/lifecycle.hpp"

namespace weft {

/// Base for drivers. A driver that inherits it writes received(), make_safe() and the commands.
/// The final class owns its timers as members, so that none outlives it.
class DriverBase : public Driver {
 public:
  explicit DriverBase(DriverHost& host) : host_(&host) {}
  ~DriverBase() override { detach(); }
  DriverBase(const DriverBase&) = delete;
  DriverBase& operator=(const DriverBase&) = delete;

  [[nodiscard]] DriverState state() const noexcept final { return state_; }

 protected:
  /// Bytes from the device, while attached.
  virtual void received(ByteView bytes, TimePoint arrival) = 0;
  /// Called on the way into a fault: end motion and streams as far as the link still allows, and
  /// cancel all timers.
  virtual void make_safe() noexcept = 0;

  [[nodiscard]] DriverHost& host() const { return *host_; }
  [[nodiscard]] TimePoint now() const { return host_->loop().now(); }

  /// Errors: wrong_state, as a sentence: "open is refused: the driver is armed".
  Status require(DriverState wanted, std::string_view action) const;

  /// Takes the link's callbacks. Errors: wrong_state, while a conversation is under way already.
  Status attach();
  void detach();
  [[nodiscard]] bool attached() const { return attached_; }

  /// Writes; a link that fails faults the driver. False then.
  bool send(ByteView bytes);
  /// Writes and ignores a failure: for the last words to a device.
  void send_last(ByteView bytes);

  /// Follows the lifecycle table and tells the host; pairs that it does not have change nothing.
  void enter(LifecycleEvent event);
  /// Makes the device safe, detaches and goes to faulted. Only the first fault counts.
  void raise(const Error& error);

 private:
  DriverHost* host_;
  DriverState state_ = DriverState::closed;
  bool attached_ = false;
};

}  // namespace weft
