#include "daemon/plugins/builtin_drivers.hpp"

#include <string>

namespace weft::daemon {

Status check_entry(const DriverEntryV1& entry) {
  if (entry.abi_version != driver_abi_version)
    return fail(Errc::unsupported, "driver built for another plugin ABI", {},
                "version " + std::to_string(driver_abi_version),
                "version " + std::to_string(entry.abi_version), "Rebuild the driver");
  if (entry.struct_size != sizeof(DriverEntryV1))
    return fail(Errc::unsupported, "driver entry of another size", {},
                std::to_string(sizeof(DriverEntryV1)) + " bytes",
                std::to_string(entry.struct_size) + " bytes", "Rebuild the driver");
  if (std::string_view(entry.build_fingerprint) != WEFT_BUILD_FINGERPRINT)
    return fail(Errc::unsupported, "driver built by another compiler", entry.name,
                WEFT_BUILD_FINGERPRINT, entry.build_fingerprint, "Rebuild the driver");
  return {};
}

Result<const DriverEntryV1*> find_driver(std::string_view name) {
  std::string known;
  for (const DriverEntryV1* entry : builtin_drivers()) {
    if (name == entry->name) {
      if (Status ok = check_entry(*entry); !ok) return pass(ok.error());
      return entry;
    }
    known += (known.empty() ? "" : ", ") + std::string(entry->name);
  }
  return fail(Errc::not_found, "no such driver", {}, known, std::string(name));
}

}  // namespace weft::daemon
