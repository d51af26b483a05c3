#include "daemon/storage/certificate/verify_json.hpp"

#include <nlohmann/json.hpp>

#include "daemon/storage/certificate/export_check.hpp"

namespace weft::daemon {

nlohmann::json exports_json(const std::vector<CheckedExport>& exports) {
  nlohmann::json out = nlohmann::json::array();
  for (const CheckedExport& one : exports)
    out.push_back({{"name", one.name},
                   {"state", to_string(one.state)},
                   {"trials", one.trials},
                   {"trials_done", one.done},
                   {"trials_done_now", one.done_now}});
  return out;
}

nlohmann::json verify_json(const VerifyReport& report) {
  nlohmann::json found_problems = nlohmann::json::array();
  for (const VerifyProblem& problem : report.found_problems)
    found_problems.push_back(
        {{"where", problem.where}, {"what", problem.what}, {"hint", problem.hint}});
  return {{"holds", report.holds()},
          {"certified", report.certified},
          {"finished", report.finished},
          {"blank", report.blank},
          {"trials_planned", report.planned},
          {"trials_complete", report.complete},
          {"attempts", report.attempts},
          {"lost_samples", report.lost_samples},
          {"dataset_sha256", report.dataset_sha256},
          {"software_version", report.software_version},
          {"exports", exports_json(report.exports)},
          {"findings", std::move(found_problems)}};
}

}  // namespace weft::daemon
