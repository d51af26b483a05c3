#pragma once
// What verify() found, as programs are told.

#include <nlohmann/json_fwd.hpp>

#include "daemon/storage/certificate/verify.hpp"

namespace weft::daemon {

/// {holds, certified, finished, blank, trials_planned, trials_complete, attempts, lost_samples,
/// dataset_sha256, software_version, exports: [exports_json()'s], findings: [{where, what, hint}]}.
nlohmann::json verify_json(const VerifyReport& report);
/// [{name, state, trials, trials_done, trials_done_now}].
nlohmann::json exports_json(const std::vector<CheckedExport>& exports);

}  // namespace weft::daemon
