#pragma once
// One device of a bench: its link, its driver and its identity and fault.

#include <functional>
#include <memory>
#include <optional>

#include "daemon/hardware/rig/rig_file.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon {

/// The host of one driver. Thread-bound to the bench's loop.
class Device final : public DriverHost {
 public:
  using SampleSink = std::function<void(const Sample&)>;
  using LogSink = std::function<void(LogLevel, std::string_view device, std::string_view text)>;

  /// Makes the driver named by `entry`. Errors: those of driver_config() and of
  /// DriverCatalog::create, each with the device's name in front.
  static Result<std::unique_ptr<Device>> create(const DeviceEntry& entry, Loop& loop,
                                                std::unique_ptr<Link> link,
                                                std::shared_ptr<DriverCatalog> drivers,
                                                std::unique_ptr<Link> http = nullptr);
  ~Device() override;

  Driver& driver() { return *driver_; }
  [[nodiscard]] const DeviceEntry& entry() const { return entry_; }
  /// The fault that the driver reported, if any.
  [[nodiscard]] const std::optional<Error>& fault_seen() const { return fault_; }

  /// Identity reported by the driver; empty until it is open.
  [[nodiscard]] const DeviceIdentity& identity() const { return identity_; }

  void on_sample(SampleSink sink) { sink_ = std::move(sink); }
  void on_log(LogSink sink) { log_ = std::move(sink); }

  Loop& loop() override { return *loop_; }
  Link& link() override { return *link_; }
  Link* http() override { return http_.get(); }
  void publish(const Sample& sample) override;
  /// Marks a device that is simulated without noise, whatever its protocol carries.
  void identified(const DeviceIdentity& identity) override {
    identity_ = identity;
    if (entry_.noiseless) identity_.reported.emplace_back("noise", "none");
  }
  void state_changed(DriverState) override {}
  void fault(const Error& error) override;
  void log(LogLevel level, std::string_view text) override;

 private:
  Device(DeviceEntry entry, Loop& loop, std::unique_ptr<Link> link,
         std::shared_ptr<DriverCatalog> drivers, std::unique_ptr<Link> http);

  DeviceEntry entry_;
  Loop* loop_;
  std::unique_ptr<Link> link_;
  std::unique_ptr<Link> http_;
  std::shared_ptr<DriverCatalog> drivers_;
  SampleSink sink_;
  LogSink log_;
  DeviceIdentity identity_;
  std::optional<Error> fault_;
  std::unique_ptr<Driver> driver_;  ///< last: it uses the members above until it is destroyed
};

}  // namespace weft::daemon
