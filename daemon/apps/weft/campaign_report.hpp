#pragma once
// Evaluation and report of a finished campaign in `weft run`: report.html and report.json.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/analysis/campaign_report/campaign_report.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/storage/certificate/handover_file.hpp"

namespace weft::daemon::cli {

// Handover of a complete campaign in `weft run`.

/// Result of a handover: `done` or `failed`.
struct RunHandover {
  std::optional<HandoverResult> done;
  std::optional<Error> failed;        ///< the campaign and its data stay valid
  std::filesystem::path folder = {};  ///< folder of `done`
  bool by_default = false;            ///< the recipe does not ask for it
};

/// Runs the handover. nullopt if the campaign is incomplete or its recipe requests none. Progress
/// goes to the console's `err`; SIGINT and SIGTERM end it.
std::optional<RunHandover> handover_of_run(const CampaignSummary& summary,
                                           const std::filesystem::path& folder, Console& console);

std::string format_text(const RunHandover& handover);
nlohmann::json json_of(const RunHandover& handover);

struct WrittenReport {
  CampaignReport report;
  std::filesystem::path html, json;  ///< written files
};

/// --beside, for run and report.
void add_beside_option(CLI::App& command, std::vector<std::filesystem::path>& beside);

/// Writes make_report() into `html`, and the JSON document beside it under the same name. Progress
/// goes to the console's `err`. `audit`: adds the quick audit, about one second for a small
/// campaign and ten for 680 trials.
Result<WrittenReport> write_report(const CampaignSummary& summary, const Dataset& dataset,
                                   const std::filesystem::path& html, ReportOptions options,
                                   bool audit, Console& console);

}  // namespace weft::daemon::cli
