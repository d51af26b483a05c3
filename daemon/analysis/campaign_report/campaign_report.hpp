#pragma once
// The report of a campaign that is over, from its data set and its folder, as text: used by
// `weft run`, `weft report` and the daemon.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/certificate/verify.hpp"

namespace weft::daemon {

struct ReportOptions {
  std::size_t repeats = 30;                ///< random splits, beside the headline
  std::size_t threads = 0;                 ///< 0: one per core
  const VerifyReport* verified = nullptr;  ///< of a report that is made afterwards
  Blocks tradeoff = {}, fidelity = {};     ///< sections
  /// Of the campaign: its headline is this one's; nullptr: measured for the report.
  const HandoverResult* handover = nullptr;
  /// Of that hand-over: evaluation.json and the records of its pages, for confusion matrices and
  /// for what was learnt from imprints, or from sound and vibration.
  std::vector<HandoverText> handover_files = {};
  /// Folders of campaigns that differ in what a repetition is: rows beside this one's.
  std::vector<std::filesystem::path> beside = {};
  std::function<std::vector<AuditHeadline>()> audit = {};  ///< empty: left out
  EvaluationSink progress = {};
  std::function<void(const std::string&)> note = {};  ///< a sentence about another step
  StopRequested stop = {};
};

struct CampaignReport {
  std::string html, json;  ///< the two documents
  std::string summary;     ///< for a terminal
  /// Why there are no accuracies: a campaign of one fabric, for example, has nothing to tell apart.
  std::optional<Error> not_classified;
  bool selected = false;  ///< not classified, for a live vote has chosen what is left
};

/// Classifies the data over random splits, unless slides of it ended early or it holds imprints or
/// a sweep, and makes both documents. Errors: a run and a data set of different benches; those of
/// campaigns beside it; wrong_state, when it was stopped.
Result<CampaignReport> make_report(const CampaignSummary& summary, const Dataset& dataset,
                                   const ReportOptions& options);

/// Of the files. Whether somebody cleaned up and how the rig was left is not in them. `dataset`: of
/// the folder. Errors: those of its campaign file.
Result<CampaignSummary> load_summary(const std::filesystem::path& folder,
                                     const VerifyReport& verified, const Dataset& dataset);

/// Those files of the campaign in `folder`; what cannot be read is left out.
std::vector<HandoverText> load_handover_files(const std::filesystem::path& folder);

/// report.html and report.json of the folder's campaign. Errors: verify()'s, load_summary()'s,
/// make_report()'s.
Result<std::vector<HandoverText>> report_texts(const std::filesystem::path& folder,
                                               const Dataset& dataset,
                                               const HandoverResult& handover,
                                               ReportOptions options);

/// "2 threads, Linux 6.1 x86_64, compiler 12.2.0": for figures of speed.
std::string machine_text();

}  // namespace weft::daemon
