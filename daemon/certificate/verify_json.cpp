#include "daemon/certificate/verify_json.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon {

nlohmann::json verify_json(const VerifyReport& report) {
  nlohmann::json findings = nlohmann::json::array();
  for (const VerifyFinding& finding : report.findings)
    findings.push_back({{"where", finding.where}, {"what", finding.what}, {"hint", finding.hint}});
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
          {"findings", std::move(findings)}};
}

}  // namespace weft::daemon
