#pragma once
// Driver for a vibration sensor: accelerometer and microphone. One page about it: README.md.

#include "drivers/api/driver.hpp"

namespace weft::drivers {

extern const DriverEntry vibro_entry;

}  // namespace weft::drivers
