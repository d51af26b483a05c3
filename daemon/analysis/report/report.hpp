#pragma once
// What is shown of a finished campaign: on the terminal, for programs, for people.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Sections about the design of campaigns, made beforehand.
struct DesignParts {
  std::string html;  ///< whole sections
  std::string json;  ///< an object or a list; empty: null
};

/// Everything a report is made of. The report reads no clock, file or machine of its own.
struct ReportInput {
  const CampaignSummary& run;
  const Dataset& dataset;
  const std::vector<ExplorationResult>& results;  ///< may be empty
  std::string machine;                            ///< "2 x AMD EPYC, Debian 12, g++ 12.2"
  std::string commit;                             ///< of the software; empty when unknown
  /// What the campaign says of campaigns to come (daemon/analysis/design); may be empty.
  DesignParts design = {};
  /// Of a report made afterwards: what looking at the files found. Nobody counted anything then
  /// while the run went on.
  const VerifyReport* verified = nullptr;
  std::string tradeoff_html = {};  ///< speed against accuracy, whole sections; may be empty
};

/// Every planned trial is there and nothing went wrong. What is shown of any other run says so.
bool is_complete(const CampaignSummary& run);
/// "INCOMPLETE, 12 of 680 trials", or empty.
std::string format_incomplete(const CampaignSummary& run);

/// Refuses a run and a data set that disagree on the kind of bench: every figure of a report bears
/// the word, so it must not be in doubt. All three writers ask first.
Status check(const ReportInput& input);

/// report.json. Keys: daemon/analysis/report/README.md. Written whole or not at all.
Status write_report_json(const ReportInput& input, const std::filesystem::path& path);

/// report.html: one file without scripts or outside resources. Written whole or not at all.
Status write_report_html(const ReportInput& input, const std::filesystem::path& path);

/// The end of a demo on a terminal: plain text, at most 80 columns, ends with a newline.
std::string summary_text(const ReportInput& input);

/// Whether it is the text of a report.json, of this version or an older one.
bool is_report_json(std::string_view text);

/// The same two documents as text.
std::string report_json(const ReportInput& input);
std::string report_html(const ReportInput& input);

}  // namespace weft::daemon
