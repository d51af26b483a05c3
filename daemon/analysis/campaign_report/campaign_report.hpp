#pragma once
// The report of a finished campaign as text, from its data set and its folder. Used by `weft run`,
// `weft report` and the daemon.

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
  std::size_t repeats = 30;                ///< random splits, in addition to the headline
  std::size_t threads = 0;                 ///< 0: one per core
  const VerifyReport* verified = nullptr;  ///< for a report made after the run
  Blocks tradeoff = {}, fidelity = {};     ///< sections
  /// Handover of the campaign, for the headline; nullptr: the headline is measured for the report.
  const HandoverResult* handover = nullptr;
  /// Files of that handover: evaluation.json and the records of its pages. They give the confusion
  /// matrices and the results from imprints, or from sound and vibration.
  std::vector<HandoverText> handover_files = {};
  /// Folders of campaigns that differ in what a repetition is: additional rows of the table.
  std::vector<std::filesystem::path> beside = {};
  std::function<std::vector<AuditHeadline>()> audit = {};  ///< empty: left out
  EvaluationSink progress = {};
  std::function<void(const std::string&)> note = {};  ///< called with a sentence about each other
                                                      ///< step
  StopRequested stop = {};
};

struct CampaignReport {
  std::string html, json;  ///< the two documents
  std::string summary;     ///< for a terminal
  /// Reason for missing accuracies: a campaign of one fabric, for example, cannot be classified.
  std::optional<Error> not_classified;
  bool selected = false;  ///< not classified, because a live vote selected the remaining slides
};

/// Makes both documents. Classifies the data over random splits, unless some slides ended early, or
/// the data holds imprints or a sweep. Errors: a run and a data set of different benches; those of
/// campaigns beside it; wrong_state if stopped.
Result<CampaignReport> make_report(const CampaignSummary& summary, const Dataset& dataset,
                                   const ReportOptions& options);

/// From the files only: the clean-up and the state of the rig are not recorded there. `dataset`:
/// the folder's. Errors: those of its campaign file.
Result<CampaignSummary> load_summary(const std::filesystem::path& folder,
                                     const VerifyReport& verified, const Dataset& dataset);

/// The files for ReportOptions::handover_files of the campaign in `folder`; unreadable files are
/// left out.
std::vector<HandoverText> load_handover_files(const std::filesystem::path& folder);

/// report.html and report.json of the folder's campaign. Errors: verify()'s, load_summary()'s,
/// make_report()'s.
Result<std::vector<HandoverText>> report_texts(const std::filesystem::path& folder,
                                               const Dataset& dataset,
                                               const HandoverResult& handover,
                                               ReportOptions options);

/// "2 threads, Linux 6.1 x86_64, compiler 12.2.0": printed beside speed results.
std::string machine_text();

}  // namespace weft::daemon
