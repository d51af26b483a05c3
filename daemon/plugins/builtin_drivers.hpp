#pragma once
// The drivers linked into this program: one per folder of drivers/, listed by CMake.

#include <span>
#include <string_view>

#include "drivers/api/driver.hpp"

namespace weft::daemon {

/// All built-in drivers, by name.
std::span<const DriverEntryV1* const> builtin_drivers();

/// The entry called `name`, checked for ABI version, struct size and build fingerprint.
Result<const DriverEntryV1*> find_driver(std::string_view name);

/// Refuses an entry that this program cannot call, with a sentence naming both versions.
Status check_entry(const DriverEntryV1& entry);

}  // namespace weft::daemon
