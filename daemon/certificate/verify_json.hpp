#pragma once
// What verify() found, as programs are told.

#include <nlohmann/json_fwd.hpp>

#include "daemon/certificate/verify.hpp"

namespace weft::daemon {

/// {holds, certified, finished, blank, trials_planned, trials_complete, attempts, lost_samples,
/// dataset_sha256, software_version, findings: [{where, what, hint}]}.
nlohmann::json verify_json(const VerifyReport& report);

}  // namespace weft::daemon
