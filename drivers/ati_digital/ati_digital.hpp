#pragma once
// Driver for an ATI Digital F/T sensor. One page about it: README.md.

#include "drivers/api/driver.hpp"

namespace weft::drivers {

extern const DriverEntry ati_digital_entry;

}  // namespace weft::drivers
