#pragma once
// The plugin's side of the C ABI: makes the table of weft_driver.h from a DriverEntry. So a C++
// driver uses Driver, Loop and Link, built in or loaded.

#include "drivers/api/driver.hpp"
#include "drivers/api/weft_driver.h"

namespace weft::plugin {

/// Implements create() of the C table: the driver with its loop, link and listener over `host`.
weft_device* create(const DriverEntry& entry, const char* config_json, const weft_host_v1* host);

/// The functions of the table that are equal for every driver; `create` is left empty.
weft_driver_entry_v1 table(const DriverEntry& entry);

/// The complete table of one driver. `entry` must be constant-initialised, because static
/// initialisation uses it.
template <const DriverEntry& entry>
weft_driver_entry_v1 table_of() {
  weft_driver_entry_v1 made = table(entry);
  made.create = [](const char* config_json, const weft_host_v1* host) {
    return create(entry, config_json, host);
  };
  return made;
}

}  // namespace weft::plugin

/// Exports the driver of `entry`, a `constinit const DriverEntry` with external linkage. Once per
/// plugin, outside every namespace.
#define WEFT_EXPORT_DRIVER(entry) \
  const weft_driver_entry_v1 weft_driver_v1 = weft::plugin::table_of<(entry)>()
