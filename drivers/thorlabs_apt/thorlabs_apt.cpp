#include "drivers/thorlabs_apt/thorlabs_apt.hpp"

#include "drivers/thorlabs_apt/stage_driver.hpp"

namespace weft::drivers {
namespace {

Result<std::unique_ptr<Driver>> create(std::string_view config_json, DriverHost& host) noexcept {
  const Result<StageSettings> settings = read_stage_settings(config_json);
  if (!settings) return pass(settings.error());
  return std::make_unique<StageDriver>(*settings, host);
}

}  // namespace

constinit const DriverEntry thorlabs_apt_entry{
    .name = "thorlabs_apt",
    .summary = "One Thorlabs stage behind an APT controller",
    .config_schema_json = stage_config_schema,
    .create = create,
};

}  // namespace weft::drivers
