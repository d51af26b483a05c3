#include "daemon/hardware/rig/device.hpp"

namespace weft::daemon {

Device::Device(DeviceEntry entry, Loop& loop, std::unique_ptr<Link> link,
               std::shared_ptr<DriverCatalog> drivers, std::unique_ptr<Link> http)
    : entry_(std::move(entry)),
      loop_(&loop),
      link_(std::move(link)),
      http_(std::move(http)),
      drivers_(std::move(drivers)) {}

Device::~Device() = default;

Result<std::unique_ptr<Device>> Device::create(const DeviceEntry& entry, Loop& loop,
                                               std::unique_ptr<Link> link,
                                               std::shared_ptr<DriverCatalog> drivers,
                                               std::unique_ptr<Link> http) {
  std::unique_ptr<Device> device(
      new Device(entry, loop, std::move(link), std::move(drivers), std::move(http)));
  const Result<std::string> config = driver_config(entry, *device->drivers_);
  if (!config) return pass(config.error(), entry.name);
  Result<std::unique_ptr<Driver>> driver =
      device->drivers_->create(entry.driver, entry.name, *config, *device);
  if (!driver) return pass(in_rig_file(entry, driver.error()), entry.name);
  device->driver_ = std::move(*driver);
  return device;
}

void Device::publish(const Sample& sample) {
  if (sink_) sink_(sample);
}

void Device::fault(const Error& error) {
  if (!fault_) fault_ = Error(error).in(entry_.name);
}

void Device::log(LogLevel level, std::string_view text) {
  if (log_) log_(level, entry_.name, text);
}

}  // namespace weft::daemon
