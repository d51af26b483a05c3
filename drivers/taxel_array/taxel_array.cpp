#include "drivers/taxel_array/taxel_array.hpp"

#include "drivers/taxel_array/taxel_driver.hpp"

namespace weft::drivers {
namespace {

Result<std::unique_ptr<Driver>> create(std::string_view config_json, DriverHost& host) noexcept {
  const Result<TaxelSettings> settings = read_taxel_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<TaxelDriver>(*settings, host);
}

}  // namespace

constinit const DriverEntry taxel_array_entry{
    .name = "taxel_array",
    .summary = "Tactile array over a serial line, or a CPM-Finger over its UDP gateway",
    .config_schema_json = taxel_config_schema,
    .create = create,
};

}  // namespace weft::drivers
