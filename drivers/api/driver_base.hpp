#pragma once
// Common parts of all drivers: the lifecycle, the callbacks of the link and the transition to
// faulted.

#include <array>
#include <exception>
#include <optional>
#include <string_view>

#include "drivers/api/driver.hpp"

namespace weft {

/// The lifecycle. A pair of state and event that is not in the table is refused.
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

/// Base of drivers. A derived class implements received(), make_safe() and the commands. It owns
/// its timers as members, so no timer outlives it. ListeningDriver has a watchdog for silence.
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
  /// Called before faulted is entered: end motion and streams as far as the link still allows, and
  /// cancel all timers.
  virtual void make_safe() noexcept = 0;

  [[nodiscard]] DriverHost& host() const { return *host_; }
  [[nodiscard]] TimePoint now() const { return host_->loop().now(); }

  /// Errors: wrong_state, as a sentence: "open is refused: the driver is armed".
  Status require(DriverState wanted, std::string_view action) const;

  /// The first step of open(): sets the callbacks of the link. Errors: wrong_state, unless the
  /// driver is closed and not attached.
  Status attach();
  void detach();
  [[nodiscard]] bool attached() const { return attached_; }

  /// Writes to the link. If the write fails, faults the driver and returns false.
  bool send(ByteView bytes);
  /// Writes and ignores a failure: for the last bytes to a device.
  void send_last(ByteView bytes);

  /// Follows the lifecycle table and notifies the host; pairs that are not in the table have no
  /// effect.
  void enter(LifecycleEvent event);
  /// Runs `read`, which decodes received bytes. An exception in it faults the driver
  /// (Errc::driver).
  template <class Read>
  void guard(Read&& read) {
    try {
      read();
    } catch (const std::exception& e) {
      raise_exception(e.what());
    }
  }
  /// Makes the device safe, detaches and enters faulted. Only the first fault counts.
  void raise(const Error& error);

 private:
  void raise_exception(const char* why);

  DriverHost* host_;
  DriverState state_ = DriverState::closed;
  bool attached_ = false;
};

/// DriverEntry::create of a driver: `read_settings` reads and checks its configuration.
template <class DriverClass, auto read_settings>
Result<std::unique_ptr<Driver>> create_driver(std::string_view config_json,
                                              DriverHost& host) noexcept {
  const auto settings = read_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<DriverClass>(*settings, host);
}

}  // namespace weft
