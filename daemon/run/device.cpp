#include "daemon/run/device.hpp"

#include "daemon/plugins/builtin_drivers.hpp"

namespace weft::daemon {

Device::Device(DeviceEntry entry, Loop& loop, std::unique_ptr<Link> link)
    : entry_(std::move(entry)), loop_(&loop), link_(std::move(link)) {}

Device::~Device() = default;

Result<std::unique_ptr<Device>> Device::create(const DeviceEntry& entry, Loop& loop,
                                               std::unique_ptr<Link> link) {
  const Result<const DriverEntryV1*> plugin = find_driver(entry.driver);
  if (!plugin) return pass(plugin.error(), entry.name);
  std::unique_ptr<Device> device(new Device(entry, loop, std::move(link)));
  Result<std::unique_ptr<Driver>> driver = (*plugin)->create(entry.config_json, *device);
  if (!driver) return pass(driver.error(), entry.name);
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
