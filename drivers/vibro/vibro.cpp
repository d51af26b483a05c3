#include "drivers/vibro/vibro.hpp"

#include "drivers/vibro/vibro_driver.hpp"

namespace weft::drivers {
namespace {

Result<std::unique_ptr<Driver>> create(std::string_view config_json, DriverHost& host) noexcept {
  const Result<VibroSettings> settings = read_vibro_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<VibroDriver>(*settings, host);
}

}  // namespace

constinit const DriverEntry vibro_entry{
    .name = "vibro",
    .summary = "Vibration sensor: blocks of accelerometer and microphone readings",
    .config_schema_json = vibro_config_schema,
    .create = create,
};

}  // namespace weft::drivers
