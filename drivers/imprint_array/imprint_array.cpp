#include "drivers/imprint_array/imprint_array.hpp"

#include "drivers/imprint_array/imprint_driver.hpp"

namespace weft::drivers {
namespace {

Result<std::unique_ptr<Driver>> create(std::string_view config_json, DriverHost& host) noexcept {
  const Result<ImprintSettings> settings = read_imprint_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<ImprintDriver>(*settings, host);
}

}  // namespace

constinit const DriverEntry imprint_array_entry{
    .name = "imprint_array",
    .summary = "Dense array of taxels for static imprints, whole or a part of it",
    .config_schema_json = imprint_config_schema,
    .create = create,
};

}  // namespace weft::drivers
