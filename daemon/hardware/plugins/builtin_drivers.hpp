#pragma once
// The drivers linked into this program: one per folder of drivers/, listed by CMake.

#include <span>

#include "drivers/api/driver.hpp"

namespace weft::daemon {

std::span<const DriverEntry* const> builtin_drivers();

}  // namespace weft::daemon
