#pragma once
// Sound files of other people.

#include <filesystem>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon {

struct SoundFile {
  double rate_hz = 0.0;
  std::vector<std::vector<double>> channels;  ///< full scale is -1 to 1
};

/// WAV and whatever else libsndfile reads, at most 2^28 samples. Errors: not_found, parse,
/// unsupported (Weft was built without libsndfile; says what to install).
Result<SoundFile> read_sound_file(const std::filesystem::path& path);

}  // namespace weft::daemon
