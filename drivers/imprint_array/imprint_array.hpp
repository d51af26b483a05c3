#pragma once
// Driver for a dense array of taxels that keeps an imprint. One page about it: README.md.

#include "drivers/api/driver.hpp"

namespace weft::drivers {

extern const DriverEntry imprint_array_entry;

}  // namespace weft::drivers
