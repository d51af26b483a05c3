#pragma once
// The content of a campaign file against itself and its certificate; what a data set shares.

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"

namespace weft::daemon {

/// Structure, every chunk's CRC-32, every trial's SHA-256, every table's rows. Adds to `report`.
/// `certificate`: nothing where there is none, or none of this state of the file. Ends early, with
/// a finding that says so, when it is to stop.
void check_campaign(const std::filesystem::path& file, const Certificate* certificate,
                    const StopRequested& stop_requested, VerifyReport& report);

/// Recipe and rig of a campaign file or a data set against their SHA-256. `where`: for a finding.
void check_documents(const DatasetInfo& info, const std::string& where, VerifyReport& report);

}  // namespace weft::daemon
