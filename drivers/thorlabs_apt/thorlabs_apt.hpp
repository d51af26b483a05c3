#pragma once
// Driver for one Thorlabs stage behind an APT controller. One page about it: README.md.

#include "drivers/api/driver.hpp"

namespace weft::drivers {

extern const DriverEntry thorlabs_apt_entry;

}  // namespace weft::drivers
