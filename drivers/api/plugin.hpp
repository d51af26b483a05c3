#pragma once
// The plugin's side of the C ABI: makes the table of weft_driver.h from a DriverEntry, so that a
// C++ driver is written against Driver, Loop and Link whether it is built in or loaded.

#include "drivers/api/driver.hpp"
#include "drivers/api/weft_driver.h"

namespace weft::plugin {

/// What create() of the C table does: the driver with its loop, link and listener over `host`.
weft_device* create(const DriverEntry& entry, const char* config_json, const weft_host_v1* host);

/// The table's functions that are the same for every driver; `create` is left empty.
weft_driver_entry_v1 table(const DriverEntry& entry);

/// The whole table of one driver. `entry` is constant-initialised, so that it is there in time.
template <const DriverEntry& entry>
weft_driver_entry_v1 table_of() {
  weft_driver_entry_v1 made = table(entry);
  made.create = [](const char* config_json, const weft_host_v1* host) {
    return create(entry, config_json, host);
  };
  return made;
}

}  // namespace weft::plugin

/// Makes a shared object of the driver behind `entry`, a `constinit const DriverEntry` that has a
/// name outside this file. Once per shared object, outside every namespace.
#define WEFT_EXPORT_DRIVER(entry) \
  const weft_driver_entry_v1 weft_driver_v1 = weft::plugin::table_of<(entry)>()
