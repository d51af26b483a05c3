#pragma once
// Recordings of sound and vibration: a separate kind of data set, without taxels, in one file.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/vibro/recording.hpp"
#include "daemon/storage/dataset/data_warnings.hpp"
#include "daemon/storage/dataset/dataset_reader.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct RecordingSet {
  std::string name;
  std::string source;  ///< "vibtac12", "lmt_sound", "hapmat", "recordings", "campaign"
  BenchKind kind = BenchKind::unknown;
  std::vector<classifier::vibro::Recording> recordings;  ///< all with the same channels
  std::vector<Warning> warnings = {};                    ///< from an import; not stored
  std::vector<std::string> group_columns = {};           ///< names of each Recording::group_values
  std::vector<GroupColumn> columns_of_trials = {};       ///< from a campaign; not stored
};

/// The first violated invariant, if any: no recordings, names that are missing or not unique, a
/// missing label, channels that differ from the first recording's, a rate that is not positive,
/// samples that are not finite, a channel without samples.
Status check(const RecordingSet& set);

/// The named columns and, for a campaign, those of its trials.
std::vector<GroupColumn> list_group_columns(const RecordingSet& set);
/// Like group_labels() of a Dataset.
Result<std::vector<std::string>> group_labels(const RecordingSet& set, std::string_view column);

/// SHA-256 of the content: kind, channels, files, labels, groups and samples. Lower-case
/// hexadecimal.
std::string recordings_sha256(const RecordingSet& set);

/// Recordings with the same samples in every channel, whatever their labels and groups.
Copies copies_in(const RecordingSet& set);

/// Warnings about every channel and about the names.
std::vector<Warning> find_data_warnings(const RecordingSet& set);

/// HDF5, layout "weft-recordings" (docs/reference/dataset.md, "Recordings"). Written to a temporary
/// file beside `path`, then renamed. Returns the digest. Errors: check()'s, io.
Result<std::string> write_recordings(const RecordingSet& set, const std::filesystem::path& path);

/// Errors: not_found; parse (not a file of this layout); unsupported (a later layout); corrupt
/// (truncated, altered, or a digest that disagrees).
Result<RecordingSet> read_recordings(const std::filesystem::path& path);

/// True if the file declares the layout "weft-recordings".
bool is_recordings_file(const std::filesystem::path& path);

/// Phase M of every complete trial of a campaign with a vibration sensor, for one exploration or
/// all. Channels: S from the microphone [Pa], X Y Z from the accelerometer [m/s2]; group: the
/// repetition. All channels start with the first block that lies wholly in M in every channel, to
/// within a sample. Refuses a data set without such streams, and a trial with blocks lost in M, by
/// name.
Result<RecordingSet> extract_recordings(const Dataset& dataset,
                                        std::optional<std::string_view> exploration = {});
/// The same from a file, with one whole trial in memory at a time. Further errors: those of
/// DatasetReader::load() and check_digest().
Result<RecordingSet> extract_recordings(DatasetReader& file,
                                        std::optional<std::string_view> exploration = {});

}  // namespace weft::daemon
