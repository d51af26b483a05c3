#pragma once
// What every driver does alike: the lifecycle, the link's callbacks, the way into a fault.

#include <array>
#include <exception>
#include <optional>
#include <string_view>

#include "drivers/api/driver.hpp"

namespace weft {

/// The lifecycle: a pair that is not in the table is refused.
enum class LifecycleEvent { opened, armed, disarmed, fault, close };

struct LifecycleRow {
  DriverState from;
  LifecycleEvent event;
  DriverState to;
};

inline constexpr std::array lifecycle_table{
    LifecycleRow{DriverState::closed, LifecycleEvent::opened, DriverState::open},
    LifecycleRow{DriverState::open, LifecycleEvent::armed, DriverState::armed},
    LifecycleRow{DriverState::armed, LifecycleEvent::disarmed, DriverState::open},
    LifecycleRow{DriverState::closed, LifecycleEvent::fault, DriverState::faulted},
    LifecycleRow{DriverState::open, LifecycleEvent::fault, DriverState::faulted},
    LifecycleRow{DriverState::armed, LifecycleEvent::fault, DriverState::faulted},
    LifecycleRow{DriverState::closed, LifecycleEvent::close, DriverState::closed},
    LifecycleRow{DriverState::open, LifecycleEvent::close, DriverState::closed},
    LifecycleRow{DriverState::armed, LifecycleEvent::close, DriverState::closed},
    LifecycleRow{DriverState::faulted, LifecycleEvent::close, DriverState::closed},
};

constexpr std::optional<DriverState> next(DriverState state, LifecycleEvent event) {
  for (const LifecycleRow& row : lifecycle_table)
    if (row.from == state && row.event == event) return row.to;
  return std::nullopt;
}

constexpr std::string_view to_string(DriverState state) {
  constexpr std::array<std::string_view, 4> names{"closed", "open", "armed", "faulted"};
  static_assert(names.size() == static_cast<std::size_t>(DriverState::faulted) + 1);
  const auto at = static_cast<std::size_t>(state);
  return at < names.size() ? names[at] : "unknown";
}

/// Base for drivers. A driver that inherits it writes received(), make_safe() and the commands.
/// A derived class owns its timers as members, so that none outlives it; ListeningDriver owns the
/// watchdog of silence.
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

  /// The first step of open(): takes the link's callbacks. Errors: wrong_state, unless the driver
  /// is closed and no conversation is under way.
  Status attach();
  void detach();
  [[nodiscard]] bool attached() const { return attached_; }

  /// Writes; a link that fails faults the driver. False then.
  bool send(ByteView bytes);
  /// Writes and ignores a failure: for the last words to a device.
  void send_last(ByteView bytes);

  /// Follows the lifecycle table and tells the host; pairs that it does not have change nothing.
  void enter(LifecycleEvent event);
  /// Runs `read`, which reads what a device sent: what it throws faults the driver (driver).
  template <class Read>
  void guard(Read&& read) {
    try {
      read();
    } catch (const std::exception& e) {
      raise_exception(e.what());
    }
  }
  /// Makes the device safe, detaches and goes to faulted. Only the first fault counts.
  void raise(const Error& error);

 private:
  void raise_exception(const char* why);

  DriverHost* host_;
  DriverState state_ = DriverState::closed;
  bool attached_ = false;
};

/// DriverEntry::create of a driver: `read_settings` reads its configuration and checks it.
template <class DriverClass, auto read_settings>
Result<std::unique_ptr<Driver>> create_driver(std::string_view config_json,
                                              DriverHost& host) noexcept {
  const auto settings = read_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<DriverClass>(*settings, host);
}

}  // namespace weft
