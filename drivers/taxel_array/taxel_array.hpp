#pragma once
// Driver for the tactile array, in either of its framings. One page about it: README.md.

#include "drivers/api/driver.hpp"

namespace weft::drivers {

extern const DriverEntry taxel_array_entry;

}  // namespace weft::drivers
