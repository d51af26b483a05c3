#pragma once
// What is shown of a finished campaign: on the terminal, for programs, for people.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/report/audit_headline.hpp"
#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/analysis/report/headline.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/simulation.hpp"
#include "daemon/pages/document/document.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Sections about the design of campaigns, made beforehand.
struct DesignParts {
  Blocks blocks;     ///< whole sections
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
  Blocks tradeoff = {};  ///< speed against accuracy, whole sections; may be empty
  Blocks fidelity = {};  ///< what the plant's fidelity costs; may be empty
  /// Campaigns that differ in what a repetition is; may be empty.
  const std::vector<CampaignBeside>* beside = nullptr;
  std::vector<AuditHeadline> audit = {};  ///< of each exploration; empty: not asked for
  std::vector<Headline> headlines = {};   ///< of each exploration; may be empty
  /// Of the hand-over: imprints, or sound and vibration. Its parts are shown with the campaign's.
  std::vector<Document> documents = {};
};

/// Whether the part about the design is a learning curve; of a sweep it is of its cells.
bool has_learning_curve(const ReportInput& input);

/// Every planned trial is there and nothing went wrong. What is shown of any other run says so.
bool is_complete(const CampaignSummary& run);
/// "INCOMPLETE, 12 of 680 trials", or empty.
std::string format_incomplete(const CampaignSummary& run);

/// Refuses a run and a data set that disagree on the kind of bench: every figure of a report bears
/// the word, so it must not be in doubt. make_report() asks first.
Status check(const ReportInput& input);

/// The end of a demo on a terminal: plain text, at most 80 columns, ends with a newline.
std::string summary_text(const ReportInput& input);

/// Whether it is the text of a report.json, of this version or an older one.
bool is_report_json(std::string_view text);

/// What report.json holds beside the page, and the page.
nlohmann::ordered_json report_record(const ReportInput& input);
Document report_document(const ReportInput& input);

/// One row for each of the input's campaigns, itself first.
struct RepetitionRow {
  std::string text;  ///< to_string(Repeated)
  const std::vector<ExplorationResult>* results = nullptr;
};
std::vector<RepetitionRow> repetition_rows(const ReportInput& input);

// How a campaign was simulated, in words: for the terminal, the page and report.json.

/// "Simulated at level L1 3.072 ms because the scene needs a wrench and taxel counts; error against
/// L2 midpoint 0.2 ms: max 12.1 mN, rms 3.0 mN": the last of the errors, which knows most. Empty
/// on a bench that is not simulated.
std::string sentence(const SimulationNote& note);
/// One line for each error.
std::vector<std::string> error_lines(const SimulationNote& note);
/// Whether an accuracy and a speed that were asked for were kept: none, one or two lines.
std::vector<std::string> promise_lines(const SimulationNote& note);
/// All for a terminal: at most 80 columns, each line ends with a newline.
std::string simulation_text(const SimulationNote& note);

// What report.json and the command line's --json have in common, in one shape.

/// Accuracy, interval and its method, deviation, number of splits.
nlohmann::ordered_json accuracy_json(const classifier::Scores& evaluation);
/// The same with the accuracy of each split, times, and the confusion matrix as
/// {"labels": [...], "count": [[...]]}: a row per true label, a column per answer.
nlohmann::ordered_json evaluation_json(const classifier::Scores& evaluation);

/// One pair of fabrics: selected features with p, parameters, errors of the cross-validation.
nlohmann::ordered_json core_json(const CoreLine& line);

/// [{"label", "exploration", "trials"}]: what a live vote left out; empty as a rule.
nlohmann::ordered_json ended_early_json(const DatasetInfo& info);

/// Which positions of each stage a plan uses, and how far they stay from the ends of its travel:
/// {"z": {"min_m", "max_m", "margin_m"}, "rx": {"min_rad", ...}, ...}.
nlohmann::json envelope_json(const recipes::Forecast& forecast);

/// The bench's time over the wall's; 0 where no wall time was measured.
double realtime_factor(const CampaignSummary& run);

/// How the run went. "error" is the first problem's sentence, or null.
nlohmann::ordered_json run_json(const CampaignSummary& run);

// Parts of the page.

/// "SIMULATED", "REAL BENCH" or "BENCH UNKNOWN"; and so in a box.
std::string_view bench_name(BenchKind kind);
std::string report_badge(BenchKind kind);
/// The badge, and "INCOMPLETE, 12 of 680 trials" where that is so.
std::string badge_html(const ReportInput& input);
/// The headlines with their confusion matrices.
Blocks headline_section(const ReportInput& input);
Blocks accuracy_pictures(const ReportInput& input);
Blocks accuracy_section(const ReportInput& input);
/// Why the random splits are not the headline, and how they were made.
Blocks accuracy_method(const ReportInput& input);
Blocks trace_section(const ReportInput& input);
Blocks repetition_section(const ReportInput& input);
Blocks core_section(const ReportInput& input);
Blocks audit_section(const ReportInput& input);
Blocks force_section(const ReportInput& input);
/// Both of "How long it takes", folded.
Blocks timing_details(const ReportInput& input);
Blocks wall_time_details(const ReportInput& input);

}  // namespace weft::daemon
