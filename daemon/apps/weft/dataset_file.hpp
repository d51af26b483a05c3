#pragma once
// Input and output files of commands.

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

// Recordings of sound and vibration: a file of recordings, or a campaign.

/// A file of recordings, or all explorations of a data set with a vibration sensor.
Result<RecordingSet> open_all_recordings(const std::filesystem::path& path);
/// The same for one exploration, chosen by find_exploration(). A file of recordings has no
/// exploration: a name is refused.
Result<RecordingSet> open_recordings(const std::filesystem::path& path,
                                     const std::string& exploration, bool one_exploration);

/// find_data_warnings() for slides, find_similar_labels() for imprints. For one exploration, or for
/// all if the name is empty or a sum such as "M1+M2".
std::vector<Warning> warnings_of(const Dataset& dataset, const std::string& exploration = {});

/// A data set. A campaign file is refused, with the command that makes a data set of it.
Result<Dataset> open_dataset(const std::filesystem::path& path);

/// Reads `in` to its end: a trial (CSV), or a whole data set, recognised by HDF5's signature. A
/// data set passes through a temporary file, because HDF5 needs to seek. Refuses a missing or empty
/// stream, more than 4 GiB, and whatever the file readers refuse.
Result<Dataset> trials_from(std::istream* in);

/// A campaign file, finished or not; its process may have been killed.
struct CampaignContents {
  Dataset dataset;  ///< complete trials; may be none
  CampaignProgress progress;
  std::map<std::string, std::size_t> left_out;  ///< incomplete attempts, by outcome
  std::size_t never_begun = 0;
};
/// Whether a damaged log is refused, or read up to the damage.
enum class CampaignLog { whole, as_far_as_it_goes };
/// Errors: those of check_wal() if the log must be whole; those of load_campaign().
Result<CampaignContents> open_campaign(const std::filesystem::path& path,
                                       CampaignLog log = CampaignLog::whole);

/// Refuses to overwrite an input file, under any name.
Status refuse_same_file(const std::filesystem::path& input, const std::filesystem::path& output);

/// Checks an output before the work: check_target(), and that it replaces no campaign file and no
/// certificate, because a recording cannot be restored.
Status check_output(const std::filesystem::path& output);
/// The same, and refuse_same_file().
Status check_output(const std::filesystem::path& input, const std::filesystem::path& output);

/// One of several files that a command writes.
struct Output {
  std::string name;            ///< "page", "data": option --data
  std::filesystem::path file;  ///< empty: not written
};
/// check_output() of each output against every input, and that no two outputs are one file.
Status check_outputs(std::span<const std::filesystem::path> inputs,
                     std::span<const Output> outputs);

}  // namespace weft::daemon::cli
