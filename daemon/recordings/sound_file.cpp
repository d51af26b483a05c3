#include "daemon/recordings/sound_file.hpp"

#ifdef WEFT_WITH_SNDFILE
#include <sndfile.h>

#include <array>
#include <fstream>
#include <memory>
#include <string_view>
#endif

namespace weft::daemon {

#ifdef WEFT_WITH_SNDFILE

namespace {

// libsndfile takes what there is of a WAV file that was cut. Its first bytes say how long it is,
// but where it was written into a pipe: arecord and SoX put about 2^31 there (0x7ffff024,
// 0x7fffff24, 0x80000024), others set all bits. A last byte of padding may be missing.
Status check_length(const std::filesystem::path& path) {
  constexpr std::uintmax_t before_count = 8, unknown = 0x7fff0000;
  std::array<unsigned char, before_count> head{};
  std::ifstream in(path, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return {};
  if (std::string_view(reinterpret_cast<const char*>(head.data()), 4) != "RIFF") return {};
  std::uintmax_t count = 0;
  for (std::size_t i = 0; i < 4; ++i) count |= std::uintmax_t{head[4 + i]} << (8 * i);
  std::error_code unread;
  const std::uintmax_t bytes = std::filesystem::file_size(path, unread);
  if (unread || count >= unknown || count + before_count <= bytes + 1) return {};
  return fail(Errc::corrupt, "the sound file is cut short", path.string(),
              std::to_string(count + before_count) + " bytes", std::to_string(bytes));
}

}  // namespace

Result<SoundFile> read_sound_file(const std::filesystem::path& path) {
  constexpr sf_count_t most_samples = sf_count_t{1} << 28U;
  if (!std::filesystem::is_regular_file(path))
    return fail(Errc::not_found, "no such sound file", path.string());
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, int (*)(SNDFILE*)> file(sf_open(path.c_str(), SFM_READ, &info),
                                                         &sf_close);
  if (!file)
    return fail(Errc::parse, "not a sound file", path.string(), "WAV or the like",
                sf_strerror(nullptr), "A table needs a name that ends in .csv");
  if (auto whole = check_length(path); !whole) return pass(whole.error());
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
