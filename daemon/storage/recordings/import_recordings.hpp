#pragma once
// Other people's recordings of sound and vibration into a RecordingSet.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// Sound files of other people.

struct SoundFile {
  double rate_hz = 0.0;
  std::vector<std::vector<double>> channels;  ///< full scale is -1 to 1
};

/// WAV and whatever else libsndfile reads, at most 2^28 samples. Errors: not_found, parse,
/// unsupported (Weft was built without libsndfile; says what to install).
Result<SoundFile> read_sound_file(const std::filesystem::path& path);

/// Manifest `file,label[,group][,bench][,recording]`, read by read_manifest(): sound files
/// (channels S, or S1 ... Sn [full scale]) or CSV with the column `t_s` and one per channel, evenly
/// sampled. Tables whose times do not tell another rate than the first one's have its rate.
/// `rate_hz`: of all tables, as stated; with 0 that of their times, which must then be evenly
/// spaced. Files with one name under `recording` are channels side by side, from the same instant
/// on and each at its rate: refused are other labels or groups, channels of one name, and tables
/// with pauses. `bench`: as stated; else the manifest's, or unknown.
Result<RecordingSet> import_recordings(const std::filesystem::path& manifest, double rate_hz = 0,
                                       std::optional<BenchKind> bench = {});

/// VibTac-12 (Kursun and Patooghy): X.csv, Y.csv, Z.csv with a line a texture at 200 Hz [count],
/// and Texture<n>.wav of some. `channels`: some of X, Y, Z, S; with S only the textures that have a
/// sound track. Labels "texture01" ..., kind real.
Result<RecordingSet> import_vibtac12(const std::filesystem::path& folder,
                                     const std::vector<std::string>& channels);

/// A folder for each material, recordings `<Material>_<nn>.wav`: label the material, group the
/// number. Kind real.
Result<RecordingSet> import_lmt_sound(const std::filesystem::path& folder);

/// HapMat: `<Surface>.csv`, columns time [s], accel_x ... rota_z. Kind real. `rate_hz` as above.
Result<RecordingSet> import_hapmat(const std::filesystem::path& folder, double rate_hz = 0);

}  // namespace weft::daemon
