#pragma once
// Driver for an ATI force/torque sensor behind a Net F/T box. One page about it: README.md.

#include "drivers/api/driver.hpp"

namespace weft::drivers {

extern const DriverEntry ati_netft_entry;

}  // namespace weft::drivers
