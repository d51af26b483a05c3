#include "drivers/ati_netft/ati_netft.hpp"

#include "drivers/ati_netft/netft_driver.hpp"

namespace weft::drivers {
namespace {

Result<std::unique_ptr<Driver>> create(std::string_view config_json, DriverHost& host) noexcept {
  const Result<NetftSettings> settings = read_netft_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<NetftDriver>(*settings, host);
}

}  // namespace

constinit const DriverEntry ati_netft_entry{
    .name = "ati_netft",
    .summary = "ATI force/torque sensor behind a Net F/T box, RDT over UDP",
    .config_schema_json = netft_config_schema,
    .create = create,
};

}  // namespace weft::drivers
