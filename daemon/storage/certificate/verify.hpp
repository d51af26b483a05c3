#pragma once
// Checks that a campaign and its data set are unchanged: digests, gaps, provenance.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/base/file/read_file.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// One difference from the recorded state.
struct VerifyProblem {
  std::string where;  ///< file, then trial, stream and chunk, or table, or byte
  std::string what;
  std::string hint = {};  ///< what to do, if anything
};

/// State of a file in export/, compared with the current campaign.
enum class ExportState : std::uint8_t {
  current,
  outdated,   ///< the run was resumed since: there are more trials
  discarded,  ///< the campaign was discarded; no data set is made of it
  missing,    ///< removed
  altered     ///< its bytes differ from the list; also a finding
};

/// A file made by data.export.
struct CheckedExport {
  std::string name;                      ///< "export/dataset.h5"
  std::uint64_t trials = 0;              ///< trials in the file
  std::uint64_t done = 0, done_now = 0;  ///< trials done in the campaign when the file was made,
                                         ///< and now
  ExportState state = ExportState::current;
};

struct VerifyReport {
  std::filesystem::path campaign, dataset;  ///< the files checked; empty if missing
  /// True if compared with a certificate, not only with the files' own digests. For a folder: both
  /// files and everything that the certificate lists.
  bool certified = false;
  bool finished = false;  ///< the campaign reached its end
  bool blank = false;     ///< the campaign file was created, but nothing was written into it
  std::size_t planned = 0, complete = 0, attempts = 0;  ///< trials of the campaign file
  std::string of = "trials";                            ///< unit of these counts: "trials", or
                                                        ///< "recordings" for a data set of
                                                        ///< recordings
  std::uint64_t lost_samples = 0;                       ///< in recorded gaps
  std::string dataset_sha256;
  std::string software_version;
  std::vector<CheckedExport> exports;  ///< only for a folder
  std::vector<VerifyProblem> found_problems;
  [[nodiscard]] bool holds() const { return found_problems.empty(); }
  void add(std::string where, std::string what, std::string hint = {}) {
    found_problems.push_back({std::move(where), std::move(what), std::move(hint)});
  }
};

/// `path`: a campaign's folder, its campaign file or a data set. Damage is a finding, not an error.
/// `stop_requested` is checked every few megabytes. Errors: not_found; parse for a file that is not
/// Weft's; unsupported for a data set that this build cannot read (a missing filter, a later
/// layout); busy if another program has locked the file; wrong_state if stopped.
Result<VerifyReport> verify(const std::filesystem::path& path,
                            const StopRequested& stop_requested = {});

// Results of verify() as JSON.

/// {holds, certified, finished, blank, trials_planned, trials_complete, attempts, lost_samples,
/// dataset_sha256, software_version, exports: [exports_json()'s], findings: [{where, what, hint}]}.
nlohmann::json verify_json(const VerifyReport& report);
/// [{name, state, trials, trials_done, trials_done_now}].
nlohmann::json exports_json(const std::vector<CheckedExport>& exports);

}  // namespace weft::daemon
