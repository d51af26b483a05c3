#pragma once
// Results of a finished campaign: for the terminal, for programs, and as a page.

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

/// Sections about the design of campaigns, made in advance.
struct DesignParts {
  Blocks blocks;     ///< whole sections
  std::string json;  ///< an object or a list; empty: null
};

/// All input of a report, which reads no clock, file or machine data itself.
struct ReportInput {
  const CampaignSummary& run;
  const Dataset& dataset;
  const std::vector<ExplorationResult>& results;  ///< may be empty
  std::string machine;                            ///< "2 x AMD EPYC, Debian 12, g++ 12.2"
  std::string commit;                             ///< of the software; empty if not known
  /// Conclusions for later campaigns (daemon/analysis/design); may be empty.
  DesignParts design = {};
  /// For a report made after the run: the result of verify(). Then no measurements from the run
  /// itself are available.
  const VerifyReport* verified = nullptr;
  Blocks tradeoff = {};  ///< speed against accuracy, whole sections; may be empty
  Blocks fidelity = {};  ///< cost of the plant's fidelity; may be empty
  /// Campaigns that differ in what a repetition is; may be null.
  const std::vector<CampaignBeside>* beside = nullptr;
  std::vector<AuditHeadline> audit = {};  ///< per exploration; empty: not requested
  std::vector<Headline> headlines = {};   ///< per exploration; may be empty
  /// Documents of the handover: imprints, or sound and vibration. Their parts are shown with the
  /// campaign's.
  std::vector<Document> documents = {};
};

/// True if the design part is a learning curve; for a sweep it is about cells.
bool has_learning_curve(const ReportInput& input);

/// True if all planned trials are complete and there was no problem. Results of any other run are
/// marked as incomplete.
bool is_complete(const CampaignSummary& run);
/// "INCOMPLETE, 12 of 680 trials", or empty.
std::string format_incomplete(const CampaignSummary& run);

/// Refuses a run and a data set with different kinds of bench: every result shows the kind, so it
/// must be unambiguous. make_report() calls this first.
Status check(const ReportInput& input);

/// The terminal text at the end of a demo: plain text, at most 80 columns, ends with a newline.
std::string summary_text(const ReportInput& input);

/// True for the text of a report.json, of this version or an older one.
bool is_report_json(std::string_view text);

/// report_record(): the content of report.json. report_document(): the page.
nlohmann::ordered_json report_record(const ReportInput& input);
Document report_document(const ReportInput& input);

/// One row per campaign of the input, starting with the input's own.
struct RepetitionRow {
  std::string text;  ///< to_string(Repeated)
  const std::vector<ExplorationResult>* results = nullptr;
};
std::vector<RepetitionRow> repetition_rows(const ReportInput& input);

// How a campaign was simulated, as text for the terminal, the page and report.json.

/// "Simulated at level L1 3.072 ms because the scene needs a wrench and taxel counts; error against
/// L2 midpoint 0.2 ms: max 12.1 mN, rms 3.0 mN". The error is the last one, which is the best
/// estimate. Empty unless the bench is simulated.
std::string sentence(const SimulationNote& note);
/// One line per error.
std::vector<std::string> error_lines(const SimulationNote& note);
/// Whether the requested accuracy and speed were reached: none, one or two lines.
std::vector<std::string> promise_lines(const SimulationNote& note);
/// All of it for a terminal: at most 80 columns, each line ends with a newline.
std::string simulation_text(const SimulationNote& note);

// JSON shared by report.json and the command line's --json.

/// Accuracy, interval and its method, deviation, number of splits.
nlohmann::ordered_json accuracy_json(const classifier::Scores& evaluation);
/// The same with the accuracy of each split, times, and the confusion matrix as {"labels": [...],
/// "count": [[...]]}: one row per true label, one column per predicted label.
nlohmann::ordered_json evaluation_json(const classifier::Scores& evaluation);

/// One pair of fabrics: selected features with p, parameters, cross-validation errors.
nlohmann::ordered_json core_json(const CoreLine& line);

/// [{"label", "exploration", "trials"}]: trials left out because of a live vote; usually empty.
nlohmann::ordered_json ended_early_json(const DatasetInfo& info);

/// Positions of each stage in a plan, and their distance to the ends of its travel: {"z": {"min_m",
/// "max_m", "margin_m"}, "rx": {"min_rad", ...}, ...}.
nlohmann::json envelope_json(const recipes::Forecast& forecast);

/// Bench time divided by wall time; 0 without a measured wall time.
double realtime_factor(const CampaignSummary& run);

/// Course of the run. "error" is the first problem's sentence, or null.
nlohmann::ordered_json run_json(const CampaignSummary& run);

// Parts of the page.

/// "SIMULATED", "REAL BENCH" or "BENCH UNKNOWN"; report_badge(): the same as an HTML badge.
std::string_view bench_name(BenchKind kind);
std::string report_badge(BenchKind kind);
/// The badge, and "INCOMPLETE, 12 of 680 trials" if that is so.
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
/// The two folded parts of "Timing".
Blocks timing_details(const ReportInput& input);
Blocks wall_time_details(const ReportInput& input);

}  // namespace weft::daemon
