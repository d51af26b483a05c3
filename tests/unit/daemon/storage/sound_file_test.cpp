// Sound files with wrong headers.

#include "daemon/storage/recordings/import_recordings.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::sound_file_test {
namespace {

using test::TemporaryFolder;
using test::write_file;

constexpr std::uint32_t samples = 1000, sample_bytes = 2 * samples;

std::string number(std::uint64_t value, int bytes, bool big = false) {
  std::string out;
  for (int i = 0; i < bytes; ++i)
    out.push_back(static_cast<char>(value >> 8 * (big ? bytes - 1 - i : i) & 0xffU));
  return out;
}

std::string pcm(bool big = false) {
  std::string out;
  for (std::uint32_t i = 0; i < samples; ++i) out += number(17 * i % 5000 + 1, 2, big);
  return out;
}

std::string format(bool big = false) {
  return "fmt " + number(16, 4, big) + number(1, 2, big) + number(1, 2, big) +
         number(8000, 4, big) + number(16000, 4, big) + number(2, 2, big) + number(16, 2, big);
}

std::string wav(std::uint32_t file_count, std::uint32_t data_count,
                const std::string& behind = {}) {
  return "RIFF" + number(file_count, 4) + "WAVE" + format() + "data" + number(data_count, 4) +
         pcm() + behind;
}

std::string rifx() {
  return "RIFX" + number(36 + sample_bytes, 4, true) + "WAVE" + format(true) + "data" +
         number(sample_bytes, 4, true) + pcm(true);
}

std::string rf64() {
  return "RF64" + number(0xffffffff, 4) + "WAVEds64" + number(28, 4) +
         number(72 + sample_bytes, 8) + number(sample_bytes, 8) + number(samples, 8) +
         number(0, 4) + format() + "data" + number(0xffffffff, 4) + pcm();
}

std::string aiff() {
  const std::string rate("\x40\x0b\xfa\x00\x00\x00\x00\x00\x00\x00", 10);  // 8000 Hz
  const std::string body = "AIFFCOMM" + number(18, 4, true) + number(1, 2, true) +
                           number(samples, 4, true) + number(16, 2, true) + rate + "SSND" +
                           number(sample_bytes + 8, 4, true) + number(0, 8, true) + pcm(true);
  return "FORM" + number(body.size(), 4, true) + body;
}

std::string au() {
  return ".snd" + number(24, 4, true) + number(sample_bytes, 4, true) + number(3, 4, true) +
         number(8000, 4, true) + number(1, 4, true) + pcm(true);
}

Result<SoundFile> read(const std::string& bytes) {
  const TemporaryFolder folder;
  write_file(folder / "a.wav", bytes);
  return read_sound_file(folder / "a.wav");
}

// An error's message; empty: all samples were read.
std::string complaint(const std::string& bytes) {
  const auto sound = read(bytes);
  if (!sound) return sound.error().what;
  REQUIRE(sound->channels.size() == 1);
  return sound->channels.front().size() == samples ? "" : "other samples";
}

std::string cut(const std::string& bytes) {
  return bytes.substr(0, bytes.size() - 500);
}

bool reads_no_sound() {
  const auto sound = read(wav(36 + sample_bytes, sample_bytes));
  if (sound || sound.error().code != Errc::unsupported) return false;
  WARN("built without libsndfile: not tested");
  return true;
}

TEST_CASE("a sound file is whole when its samples are, whatever else its header counts") {
  if (reads_no_sound()) return;
  CHECK(complaint(wav(36 + sample_bytes, sample_bytes)).empty());
  CHECK(complaint(wav(44 + sample_bytes, sample_bytes)).empty());  // with the first 8 bytes
  CHECK(complaint(wav(60 + sample_bytes, sample_bytes)).empty());
  const std::string list = "LIST" + number(26, 4) + "INFO";  // without the rest
  CHECK(complaint(wav(36 + sample_bytes + 34, sample_bytes, list)).empty());
  for (const std::uint32_t unknown : {0x7ffff000U, 0x7fffff00U, 0x80000000U, 0xffffffffU})
    CHECK(complaint(wav(unknown, unknown)).empty());
  for (const std::string& whole : {rifx(), rf64(), aiff(), au()}) CHECK(complaint(whole).empty());
}

TEST_CASE("a sound file that lacks samples is truncated, whatever the total count in the header") {
  if (reads_no_sound()) return;
  CHECK(complaint(cut(wav(36 + sample_bytes, sample_bytes))).ends_with("truncated"));
  CHECK(complaint(cut(wav(400, sample_bytes))).ends_with("truncated"));
  CHECK(complaint(wav(36 + sample_bytes, sample_bytes + 100'000)).ends_with("truncated"));
  for (const std::string& whole : {rifx(), rf64(), aiff(), au()})
    CHECK(complaint(cut(whole)).ends_with("truncated"));
}

TEST_CASE("a header without lengths is reported as unfinished") {
  if (reads_no_sound()) return;
  CHECK(complaint(wav(0, 0)).ends_with("not finished"));
  CHECK(complaint(wav(36, 0)).ends_with("not finished"));
}

TEST_CASE("a name that no file can have is a sound file that is not there") {
  const TemporaryFolder folder;
  CHECK_FALSE(read_sound_file(folder / (std::string(300, 'x') + ".wav")));
}

}  // namespace
}  // namespace weft::daemon::sound_file_test
