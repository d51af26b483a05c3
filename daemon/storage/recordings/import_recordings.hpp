#pragma once
// Imports third-party recordings of sound and vibration into a RecordingSet.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// Third-party sound files.

struct SoundFile {
  double rate_hz = 0.0;
  std::vector<std::vector<double>> channels;  ///< full scale is -1 to 1
};

/// Reads WAV and other formats of libsndfile, at most 2^28 samples. Errors: not_found, parse,
/// corrupt (truncated), unsupported (built without libsndfile, or the library is not installed; the
/// hint names what to install).
Result<SoundFile> read_sound_file(const std::filesystem::path& path);

/// Manifest `file,label[,group][,bench][,recording]`, read by read_manifest(). It lists sound files
/// (channels S, or S1 ... Sn [full scale]) or CSV tables with the column `t_s` and one column per
/// channel, evenly sampled.
///
/// Tables get the rate of the first table, unless their times show another. `rate_hz`: stated rate
/// of all tables; 0: the rate of their times, which must then be evenly spaced.
///
/// Files with the same name under `recording` are channels of one recording. They start at the same
/// instant, each with its own rate. Refused are differing labels or groups, channels of the same
/// name, and tables with pauses. `bench`: as stated; otherwise the manifest's, or unknown.
Result<RecordingSet> import_recordings(const std::filesystem::path& manifest, double rate_hz = 0,
                                       std::optional<BenchKind> bench = {});

/// VibTac-12 (Kursun and Patooghy): X.csv, Y.csv, Z.csv with one line per texture at 200 Hz
/// [count], and Texture<n>.wav of some textures. `channels`: some of X, Y, Z, S; with S only the
/// textures that have a sound track. Labels "texture01" ..., kind real.
Result<RecordingSet> import_vibtac12(const std::filesystem::path& folder,
                                     const std::vector<std::string>& channels);

/// One folder per material with recordings `<Material>_<nn>.wav`. Label: the material; group: the
/// number. Kind real.
Result<RecordingSet> import_lmt_sound(const std::filesystem::path& folder);

/// HapMat: `<Surface>.csv`, columns time [s], accel_x ... rota_z. Kind real. `rate_hz`: see
/// import_recordings().
Result<RecordingSet> import_hapmat(const std::filesystem::path& folder, double rate_hz = 0);

}  // namespace weft::daemon
