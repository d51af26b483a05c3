#include "daemon/base/file/file_kind.hpp"
#include "daemon/storage/recordings/import_recordings.hpp"

#ifdef WEFT_WITH_SNDFILE
#include <dlfcn.h>
#include <sndfile.h>

#include <array>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#endif

namespace weft::daemon {

#ifdef WEFT_WITH_SNDFILE

namespace {

enum class ByteOrder { little, big };

/// Start of the samples in a file, and their length according to the header [bytes].
struct SampleChunk {
  std::uintmax_t begin = 0, bytes = 0;
};

/// Reads fields of a sound file's header by their offset.
class SoundHeader {
 public:
  explicit SoundHeader(const std::filesystem::path& path) : in_(path, std::ios::binary) {}

  std::string name(std::uintmax_t at) {
    std::array<char, 4> out{};
    return read(at, out.data(), out.size()) ? std::string(out.begin(), out.end()) : std::string();
  }

  std::optional<std::uintmax_t> number(std::uintmax_t at, std::size_t bytes, ByteOrder order) {
    std::array<char, 8> field{};
    if (!read(at, field.data(), bytes)) return std::nullopt;
    std::uintmax_t out = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      const std::size_t most_first = order == ByteOrder::big ? i : bytes - 1 - i;
      out = out << 8U | static_cast<unsigned char>(field[most_first]);
    }
    return out;
  }

 private:
  bool read(std::uintmax_t at, char* out, std::size_t bytes) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    return bool(in_.read(out, static_cast<std::streamsize>(bytes)));
  }

  std::ifstream in_;
};

// A chunk is a name, a length and that number of bytes, padded to an even number. RF64 stores the
// length of its samples in `ds64`, after the length of the file.
std::optional<SampleChunk> find_samples(SoundHeader& header, std::string_view chunk,
                                        ByteOrder order) {
  constexpr std::uintmax_t first_chunk = 12, chunk_head = 8, in_ds64 = 0xffffffff;
  std::optional<std::uintmax_t> long_bytes;
  constexpr int most_chunks = 1000;  // in a file of zeros every eight bytes would be a chunk
  std::uintmax_t at = first_chunk;
  for (int chunks = 0; chunks < most_chunks; ++chunks) {
    const std::string name = header.name(at);
    const auto bytes = header.number(at + 4, 4, order);
    if (!bytes) return std::nullopt;
    const std::uintmax_t begin = at + chunk_head;
    if (name == chunk)
      return SampleChunk{begin, *bytes == in_ds64 && long_bytes ? *long_bytes : *bytes};
    if (name == "ds64") long_bytes = header.number(begin + 8, 8, order);
    at = begin + *bytes + *bytes % 2;
  }
  return std::nullopt;
}

std::optional<SampleChunk> samples_of(SoundHeader& header) {
  const std::string kind = header.name(0);
  if (kind == "RIFF" || kind == "RF64") return find_samples(header, "data", ByteOrder::little);
  if (kind == "RIFX") return find_samples(header, "data", ByteOrder::big);
  if (kind == "FORM") return find_samples(header, "SSND", ByteOrder::big);
  if (kind != ".snd") return std::nullopt;
  const auto begin = header.number(4, 4, ByteOrder::big);
  const auto bytes = header.number(8, 4, ByteOrder::big);
  return begin && bytes ? std::optional(SampleChunk{*begin, *bytes}) : std::nullopt;
}

tl::unexpected<Error> broken(const std::filesystem::path& path, Errc code, std::string what,
                             std::string expected, std::string got, std::string hint = {}) {
  return fail({.code = code,
               .where = path,
               .what = std::move(what),
               .expected = std::move(expected),
               .got = std::move(got),
               .hint = std::move(hint)});
}

// False for lengths that arecord and SoX write into a pipe (0x7ffff000, 0x7fffff00, 0x80000000, for
// AIFF 0x7f000000, each a few bytes more), and for all bits set.
bool writer_knew(std::uintmax_t bytes) {
  return bytes < 0x7f000000 || bytes > 0xffffffff;
}

// Checks that a WAV, AIFF or AU file has all samples that its header announces. The length of the
// whole file is often wrong, and chunks after the samples do not matter.
Status check_length(const std::filesystem::path& path) {
  SoundHeader header(path);
  const auto samples = samples_of(header);
  std::error_code unread;
  const std::uintmax_t bytes = std::filesystem::file_size(path, unread);
  if (!samples || unread || !writer_knew(samples->bytes)) return {};
  if (samples->bytes == 0 && bytes > samples->begin)
    return broken(path, Errc::corrupt, "header of the sound file not finished",
                  "the length of the samples",
                  "0, followed by " + std::to_string(bytes - samples->begin) + " bytes",
                  "Write the header again, for example with: sox --ignore-length OLD NEW");
  if (samples->begin <= bytes && samples->bytes <= bytes - samples->begin) return {};
  return broken(path, Errc::corrupt, "sound file truncated",
                std::to_string(samples->begin + samples->bytes) + " bytes",
                std::to_string(bytes) + " bytes");
}

// libsndfile, loaded with the first sound file: with its codecs it takes 0.8 MB, which a daemon
// without sound files saves. Members are named as in its header; all null if the library is
// missing.
struct SndfileLibrary {
  decltype(&::sf_open) open = nullptr;
  decltype(&::sf_close) close = nullptr;
  decltype(&::sf_strerror) strerror = nullptr;
  decltype(&::sf_readf_double) readf_double = nullptr;
};

template <class Function>
bool find(void* library, const char* name, Function& out) {
  out = reinterpret_cast<Function>(::dlsym(library, name));
  return out != nullptr;
}

SndfileLibrary load_sndfile() {
  void* const library = ::dlopen("libsndfile.so.1", RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  SndfileLibrary out;
  const bool is_whole = library != nullptr && find(library, "sf_open", out.open) &&
                        find(library, "sf_close", out.close) &&
                        find(library, "sf_strerror", out.strerror) &&
                        find(library, "sf_readf_double", out.readf_double);
  return is_whole ? out : SndfileLibrary{};
}

}  // namespace

Result<SoundFile> read_sound_file(const std::filesystem::path& path) {
  static const SndfileLibrary sndfile = load_sndfile();
  constexpr sf_count_t most_samples = sf_count_t{1} << 28U;
  std::error_code unread;
  if (!std::filesystem::is_regular_file(path, unread))
    return broken(path, Errc::not_found, "sound file not found", {},
                  unread ? unread.message() : "");
  // libsndfile reads a truncated file without an error.
  if (auto whole = check_length(path); !whole) return pass(whole.error());
  if (sndfile.open == nullptr)
    return broken(path, Errc::unsupported, "libsndfile not found", "libsndfile.so.1", {},
                  "Install libsndfile1");
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, int (*)(SNDFILE*)> file(
      sndfile.open(path.c_str(), SFM_READ, &info), sndfile.close);
  if (!file) {
    const Error error = broken(path, Errc::parse, "not a sound file", "WAV or a similar format",
                               sndfile.strerror(nullptr), "Give a table a name that ends in .csv")
                            .value();
    Error named = with_file_kind(error, path);
    return fail(named.got == "text" ? error : std::move(named));
  }
  if (info.channels < 1 || info.frames < 1 || info.samplerate < 1 ||
      info.frames > most_samples / info.channels)
    return broken(path, Errc::parse, "size of the sound file out of range", "1 to 2^28 samples",
                  std::to_string(info.frames) + " x " + std::to_string(info.channels));
  const auto channels = static_cast<std::size_t>(info.channels);
  std::vector<double> all(static_cast<std::size_t>(info.frames) * channels);
  const sf_count_t got = sndfile.readf_double(file.get(), all.data(), info.frames);
  if (got != info.frames)
    return broken(path, Errc::corrupt, "sound file truncated",
                  std::to_string(info.frames) + " samples", std::to_string(got) + " samples");
  SoundFile out{static_cast<double>(info.samplerate), {}};
  out.channels.resize(channels);
  for (std::size_t i = 0; i < all.size(); ++i) out.channels[i % channels].push_back(all[i]);
  return out;
}

#else

Result<SoundFile> read_sound_file(const std::filesystem::path& path) {
  return fail({.code = Errc::unsupported,
               .where = path.string(),
               .what = "sound files not supported by this build",
               .hint = "Install libsndfile1-dev and build Weft again"});
}

#endif

}  // namespace weft::daemon
