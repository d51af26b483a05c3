#include "drivers/ati_digital/ati_digital.hpp"

#include "drivers/ati_digital/digital_driver.hpp"

namespace weft::drivers {
namespace {

Result<std::unique_ptr<Driver>> create(std::string_view config_json, DriverHost& host) noexcept {
  const Result<DigitalSettings> settings = read_digital_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<DigitalDriver>(*settings, host);
}

}  // namespace

constinit const DriverEntry ati_digital_entry{
    .name = "ati_digital",
    .summary = "ATI Digital force/torque sensor, Modbus RTU and its raw stream",
    .config_schema_json = digital_config_schema,
    .create = create,
};

}  // namespace weft::drivers
