#pragma once
// Whether a campaign and its data set are what was recorded: digests, gaps, provenance.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/base/file/read_file.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Something that is not as it was.
struct VerifyProblem {
  std::string where;  ///< file, then trial, stream and chunk, or table, or bytes
  std::string what;
  std::string hint = {};  ///< what there is to do, where there is something
};

/// How a file of export/ stands to the campaign as it is now.
enum class ExportState : std::uint8_t {
  current,
  outdated,   ///< the run was gone on with since: there are more trials
  discarded,  ///< the campaign was, and no data set is to be made of it
  missing,    ///< removed
  altered     ///< its bytes are not as listed: a finding as well
};

/// A file that data.export made.
struct CheckedExport {
  std::string name;                      ///< "export/dataset.h5"
  std::uint64_t trials = 0;              ///< that are in it
  std::uint64_t done = 0, done_now = 0;  ///< trials that the campaign had when it was made; has now
  ExportState state = ExportState::current;
};

struct VerifyReport {
  std::filesystem::path campaign, dataset;  ///< what was looked at; empty: not there
  /// Compared with a certificate, not only with the files' own digests; of a folder: each of its
  /// two files, and all that the certificate lists.
  bool certified = false;
  bool finished = false;  ///< the campaign came to its end
  bool blank = false;     ///< the campaign file was made, and nothing was written into it
  std::size_t planned = 0, complete = 0, attempts = 0;  ///< trials of the campaign file
  std::string of = "trials";                            ///< what a data set alone holds
  std::uint64_t lost_samples = 0;                       ///< in gaps that are on record
  std::string dataset_sha256;
  std::string software_version;
  std::vector<CheckedExport> exports;  ///< of a folder
  std::vector<VerifyProblem> found_problems;
  [[nodiscard]] bool holds() const { return found_problems.empty(); }
  void add(std::string where, std::string what, std::string hint = {}) {
    found_problems.push_back({std::move(where), std::move(what), std::move(hint)});
  }
};

/// `path`: a campaign's folder, its campaign file or a data set. Damage is a finding, however bad.
/// `stop_requested` is looked at every few megabytes. Errors: not_found; parse of a file that never
/// was one of ours; unsupported, of a data set that this build cannot read (a filter that it lacks,
/// a later layout); wrong_state when it was stopped.
Result<VerifyReport> verify(const std::filesystem::path& path,
                            const StopRequested& stop_requested = {});

// What verify() found, as programs are told.

/// {holds, certified, finished, blank, trials_planned, trials_complete, attempts, lost_samples,
/// dataset_sha256, software_version, exports: [exports_json()'s], findings: [{where, what, hint}]}.
nlohmann::json verify_json(const VerifyReport& report);
/// [{name, state, trials, trials_done, trials_done_now}].
nlohmann::json exports_json(const std::vector<CheckedExport>& exports);

}  // namespace weft::daemon
