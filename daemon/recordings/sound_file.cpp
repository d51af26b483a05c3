#include "daemon/recordings/sound_file.hpp"

#ifdef WEFT_WITH_SNDFILE
#include <sndfile.h>

#include <memory>
#endif

namespace weft::daemon {

#ifdef WEFT_WITH_SNDFILE

Result<SoundFile> read_sound_file(const std::filesystem::path& path) {
  constexpr sf_count_t most_samples = sf_count_t{1} << 28U;
  if (!std::filesystem::is_regular_file(path))
    return fail(Errc::not_found, "no such sound file", path.string());
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, int (*)(SNDFILE*)> file(sf_open(path.c_str(), SFM_READ, &info),
                                                         &sf_close);
  if (!file) return fail(Errc::parse, sf_strerror(nullptr), path.string());
  if (info.channels < 1 || info.frames < 1 || info.samplerate < 1 ||
      info.frames > most_samples / info.channels)
    return fail(Errc::parse, "a sound file of an impossible size", path.string(),
                "1 to 2^28 samples",
                std::to_string(info.frames) + " x " + std::to_string(info.channels));
  const auto channels = static_cast<std::size_t>(info.channels);
  std::vector<double> all(static_cast<std::size_t>(info.frames) * channels);
  const sf_count_t got = sf_readf_double(file.get(), all.data(), info.frames);
  if (got != info.frames)
    return fail(Errc::corrupt, "the sound file is cut short", path.string(),
                std::to_string(info.frames) + " samples", std::to_string(got));
  SoundFile out{static_cast<double>(info.samplerate), {}};
  out.channels.resize(channels);
  for (std::size_t i = 0; i < all.size(); ++i) out.channels[i % channels].push_back(all[i]);
  return out;
}

#else

Result<SoundFile> read_sound_file(const std::filesystem::path& path) {
  return fail(Errc::unsupported, "this build of Weft reads no sound files", path.string(), {}, {},
              "Install libsndfile1-dev and build again");
}

#endif

}  // namespace weft::daemon
