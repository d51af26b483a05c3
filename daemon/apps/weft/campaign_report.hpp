#pragma once
// What `weft run` does with a finished campaign: classify it and write report.html and report.json.

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

// What `weft run` does with a complete campaign that is evaluated.

/// One of the two.
struct RunHandover {
  std::optional<HandoverResult> done;
  std::optional<Error> failed;        ///< the campaign and its data are what they are all the same
  std::filesystem::path folder = {};  ///< of what was done
  bool by_default = false;            ///< the recipe does not ask for it
};

/// Nothing where the campaign is not complete or its recipe wants none. Progress goes to the
/// console's `err`; SIGINT and SIGTERM end it.
std::optional<RunHandover> handover_of_run(const CampaignSummary& summary,
                                           const std::filesystem::path& folder, Console& console);

std::string format_text(const RunHandover& handover);
nlohmann::json json_of(const RunHandover& handover);

struct WrittenReport {
  CampaignReport report;
  std::filesystem::path html, json;  ///< where it is
};

/// --beside, for run and report.
void add_beside_option(CLI::App& command, std::vector<std::filesystem::path>& beside);

/// make_report(), written into `html` and the JSON document beside it under the same name.
/// Progress goes to the console's `err`. `audit`: its quick form, a second for a small campaign,
/// ten for 680 trials.
Result<WrittenReport> write_report(const CampaignSummary& summary, const Dataset& dataset,
                                   const std::filesystem::path& html, ReportOptions options,
                                   bool audit, Console& console);

}  // namespace weft::daemon::cli
