#pragma once
// Files that commands read data from and write results to.

#include <filesystem>
#include <iosfwd>
#include <map>
#include <span>
#include <string>

#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

// Recordings of sound and vibration, as commands are given them: a file of them, or a campaign.

/// A file of recordings, or those of a data set with a vibration sensor, of all its explorations.
Result<RecordingSet> open_all_recordings(const std::filesystem::path& path);
/// The same, but of the exploration that is meant, as find_exploration() tells; a file of
/// recordings has none, and refuses a name.
Result<RecordingSet> open_recordings(const std::filesystem::path& path,
                                     const std::string& exploration, bool one_exploration);

/// find_data_warnings() of slides; of imprints only those of their names. Of one exploration, of
/// all where it is empty or a sum.
std::vector<Warning> warnings_of(const Dataset& dataset, const std::string& exploration = {});

/// A data set; a campaign file is refused with the command that makes a data set of it.
Result<Dataset> open_dataset(const std::filesystem::path& path);

/// Reads `in` to its end: a trial (CSV), or a whole data set, told by HDF5's signature. A data set
/// goes through a temporary file that is gone afterwards, because HDF5 needs to seek. Refuses no
/// stream, nothing in it, more than 4 GiB, and what readers of files refuse.
Result<Dataset> trials_from(std::istream* in);

/// A campaign file, finished or not, of a process that may have been killed.
struct CampaignContents {
  Dataset dataset;  ///< complete trials; may be none
  CampaignProgress progress;
  std::map<std::string, std::size_t> left_out;  ///< attempts that are not complete, by outcome
  std::size_t never_begun = 0;
};
/// Whether what lies before the damage of its log is better than nothing.
enum class CampaignLog { whole, as_far_as_it_goes };
/// Errors: check_wal()'s, where the log has to be; load_campaign()'s.
Result<CampaignContents> open_campaign(const std::filesystem::path& path,
                                       CampaignLog log = CampaignLog::whole);

/// Refuses to write over a file that is read, under whatever name.
Status refuse_same_file(const std::filesystem::path& input, const std::filesystem::path& output);

/// What could be known of an output before the work: check_target(), and that it would take the
/// place of no campaign file and of no certificate: nothing brings a recording back.
Status check_output(const std::filesystem::path& output);
/// The same, and refuse_same_file().
Status check_output(const std::filesystem::path& input, const std::filesystem::path& output);

/// One of several files that a command writes.
struct Output {
  std::string name;            ///< "page", "data": option --data
  std::filesystem::path file;  ///< empty: not written
};
/// check_output() of each beside every input, and that no two of them are one file.
Status check_outputs(std::span<const std::filesystem::path> inputs,
                     std::span<const Output> outputs);

}  // namespace weft::daemon::cli
