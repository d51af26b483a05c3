#pragma once
// Is the unit at the other end the one that the configuration means?

#include "drivers/thorlabs_apt/settings.hpp"
#include "protocols/apt/bodies.hpp"

namespace weft::drivers {

/// Compares the controller's model, its stage id and its channels with the settings.
/// Errors: device, naming both sides.
Status check_identity(const StageSettings& settings, const protocols::apt::HardwareInfo& info);

/// "LTS150, serial 45000001, firmware 1.2.3".
std::string describe(const protocols::apt::HardwareInfo& info);

}  // namespace weft::drivers
