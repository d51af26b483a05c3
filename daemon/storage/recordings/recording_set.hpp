#pragma once
// Recordings of sound and vibration: a data set of its own kind, without taxels, in a file.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/vibro/recording.hpp"
#include "daemon/storage/dataset/data_warnings.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct RecordingSet {
  std::string name;
  std::string source;  ///< "vibtac12", "lmt_sound", "hapmat", "recordings", "campaign"
  BenchKind kind = BenchKind::unknown;
  std::vector<classifier::vibro::Recording> recordings;  ///< all with the same channels
  std::vector<Warning> warnings = {};                    ///< of an import; in no file
  std::vector<std::string> group_columns = {};           ///< names of each Recording::group_values
  std::vector<GroupColumn> columns_of_trials = {};       ///< of a campaign; in no file
};

/// The first broken promise, if any: no recordings, names that are missing or not unique, a missing
/// label, other channels than the first one's, a rate that is not positive, samples that are not
/// finite, a channel without samples.
Status check(const RecordingSet& set);

/// The named columns, and of a campaign those of its trials.
std::vector<GroupColumn> list_group_columns(const RecordingSet& set);
/// As that of a data set of trials.
Result<std::vector<std::string>> group_labels(const RecordingSet& set, std::string_view column);

/// SHA-256 of the content: kind, channels, files, labels, groups and samples. Lower-case
/// hexadecimal.
std::string recordings_sha256(const RecordingSet& set);

/// Recordings with the same samples in every channel, whatever their labels and groups.
Copies copies_in(const RecordingSet& set);

/// Of every channel, and of the names.
std::vector<Warning> find_data_warnings(const RecordingSet& set);

/// HDF5, layout "weft-recordings" (daemon/storage/recordings/README.md). Written beside `path` and
/// renamed. Returns the digest. Errors: check()'s, io.
Result<std::string> write_recordings(const RecordingSet& set, const std::filesystem::path& path);

/// Errors: not_found; parse (no such file); unsupported (a later layout); corrupt (cut short,
/// altered, or a digest that disagrees).
Result<RecordingSet> read_recordings(const std::filesystem::path& path);

/// Whether the file says that it is one.
bool is_recordings_file(const std::filesystem::path& path);

/// Phase M of every complete trial of a campaign with a vibration sensor (of one exploration, or of
/// all): S from the microphone
/// [Pa], X Y Z from the accelerometer [m/s2], the group its repetition. All channels begin where
/// the last of them has its first whole block in M, to within a sample. Refuses a data set without
/// such streams, and a trial with blocks lost in M, by name.
Result<RecordingSet> extract_recordings(const Dataset& dataset,
                                        std::optional<std::string_view> exploration = {});

}  // namespace weft::daemon
