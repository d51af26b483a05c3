#pragma once
// What `weft run` does with a finished campaign: classify it and write report.html and report.json.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/certificate/verify.hpp"

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

struct CampaignReport {
  std::string summary;  ///< for a terminal
  std::filesystem::path html;
  std::filesystem::path json;
  /// Why there are no accuracies: a campaign of one fabric, for example, has nothing to tell apart.
  std::optional<Error> not_classified;
  bool selected = false;  ///< not classified, for a live vote has chosen what is left
};

/// Of a report that is made afterwards.
struct ReportExtras {
  const VerifyReport* verified = nullptr;
  std::string tradeoff_html = {};  ///< sections
  /// Of the campaign: its headline is this one's; nullptr: measured for the report.
  const HandoverResult* handover = nullptr;
  /// Folders of campaigns that differ in what a repetition is: rows beside this one's.
  std::vector<std::filesystem::path> beside = {};
  bool audit = true;  ///< its quick form: a second for a small campaign, ten for 680 trials
};
/// --beside, for run and report.
void add_beside_option(CLI::App& command, std::vector<std::filesystem::path>& beside);

/// Classifies a campaign's data over `repeats` random splits, unless slides of it ended early, and
/// writes the report into `html` and the JSON document beside it under the same name. Progress goes
/// to the console's `err`.
Result<CampaignReport> write_report(const CampaignSummary& summary, const Dataset& dataset,
                                    const std::filesystem::path& html, std::size_t repeats,
                                    const ReportExtras& extras, Console& console);

/// "2 threads, Linux 6.1 x86_64, compiler 12.2.0": for figures of speed.
std::string machine_text();

}  // namespace weft::daemon::cli
