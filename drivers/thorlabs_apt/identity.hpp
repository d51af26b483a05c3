#pragma once
// Is the unit at the other end the one that the configuration means?

#include "drivers/api/driver.hpp"
#include "drivers/thorlabs_apt/settings.hpp"
#include "protocols/apt/bodies.hpp"

namespace weft::drivers {

/// Compares the controller's model, its stage id and its channels with the settings, and whether
/// the stage's scale on that controller is known. Errors: device, naming both sides.
Status check_identity(const StageSettings& settings, const protocols::apt::HardwareInfo& info);

/// What the controller says of itself, and the scale of its counts.
DeviceIdentity identity_of(const StageSettings& settings, const protocols::apt::HardwareInfo& info);

}  // namespace weft::drivers
