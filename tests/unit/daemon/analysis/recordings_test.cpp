// Recordings of sound and vibration: file, imports, recordings of a campaign.

#include <catch2/catch.hpp>

#include <cstdio>
#include <filesystem>

#include "daemon/analysis/handover/train.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recordings/import_recordings.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::recordings_test {
namespace {

using classifier::vibro::Recording;

using test::TemporaryFolder;
using test::write_file;

RecordingSet small_set() {
  RecordingSet out{"small", "recordings", BenchKind::real, {}};
  for (int r = 0; r < 3; ++r) {
    Recording own{"r" + std::to_string(r),
                  r < 2 ? "felt" : "foil",
                  std::to_string(r),
                  {{"S", 8000.0, "Pa"}, {"X", 200.0, "m/s2"}},
                  {{0.5, -0.25, 1e-9}, {}}};
    for (int i = 0; i <= r; ++i) own.samples[1].push_back(0.1 * i);
    out.recordings.push_back(std::move(own));
  }
  return out;
}

TEST_CASE("Recordings come back from their file as they were, digest and all") {
  const TemporaryFolder folder;
  const RecordingSet set = small_set();
  const auto digest = write_recordings(set, folder / "a.h5");
  REQUIRE(digest);
  CHECK(*digest == recordings_sha256(set));
  CHECK(is_recordings_file(folder / "a.h5"));
  const auto back = read_recordings(folder / "a.h5");
  REQUIRE(back);
  CHECK(back->name == "small");
  CHECK(back->kind == BenchKind::real);
  REQUIRE(back->recordings.size() == 3);
  CHECK(back->recordings[2].samples == set.recordings[2].samples);
  CHECK(back->recordings[2].channels == set.recordings[2].channels);
  CHECK(back->recordings[2].label == "foil");
  CHECK(recordings_sha256(*back) == *digest);
  RecordingSet simulated = set;
  simulated.kind = BenchKind::simulated;
  CHECK(recordings_sha256(simulated) != *digest);
}

TEST_CASE("Recordings that break a promise are not written, damaged files are not read") {
  const TemporaryFolder folder;
  const auto refuses = [&](auto change) {
    RecordingSet set = small_set();
    change(set);
    return !write_recordings(set, folder / "b.h5") && !std::filesystem::exists(folder / "b.h5");
  };
  CHECK(refuses([](RecordingSet& s) { s.recordings.clear(); }));
  CHECK(refuses([](RecordingSet& s) { s.recordings[1].file = "r0"; }));
  CHECK(refuses([](RecordingSet& s) { s.recordings[1].label.clear(); }));
  CHECK(refuses([](RecordingSet& s) { s.recordings[1].channels[0].rate_hz = 44100.0; }));
  CHECK(refuses([](RecordingSet& s) { s.recordings[1].samples[0][1] = std::nan(""); }));
  CHECK(refuses([](RecordingSet& s) { s.recordings[1].samples[0].clear(); }));
  CHECK(refuses([](RecordingSet& s) {
    for (auto& r : s.recordings) r.channels[1].rate_hz = 0.0;
  }));

  REQUIRE(write_recordings(small_set(), folder / "a.h5"));
  const auto size = std::filesystem::file_size(folder / "a.h5");
  std::filesystem::copy(folder / "a.h5", folder / "cut.h5");
  std::filesystem::resize_file(folder / "cut.h5", size / 2);
  CHECK_FALSE(read_recordings(folder / "cut.h5"));
  CHECK_FALSE(is_recordings_file(folder / "none.h5"));
  write_file(folder / "text.h5", "no HDF5");
  CHECK_FALSE(read_recordings(folder / "text.h5"));
}

// 16 bits, mono or stereo, by the format's own description.
std::string wav(int channels, int rate, const std::vector<int>& samples) {
  std::string out;
  const auto number = [&](std::uint32_t v, int bytes) {
    for (int i = 0; i < bytes; ++i) out.push_back(static_cast<char>(v >> (8 * i) & 0xffU));
  };
  const auto bytes = static_cast<std::uint32_t>(2 * samples.size());
  out += "RIFF";
  number(36 + bytes, 4);
  out += "WAVEfmt ";
  number(16, 4);
  number(1, 2);
  number(static_cast<std::uint32_t>(channels), 2);
  number(static_cast<std::uint32_t>(rate), 4);
  number(static_cast<std::uint32_t>(rate * channels * 2), 4);
  number(static_cast<std::uint32_t>(channels * 2), 2);
  number(16, 2);
  out += "data";
  number(bytes, 4);
  for (const int s : samples) number(static_cast<std::uint32_t>(s), 2);
  return out;
}

bool have_sound() {
  const TemporaryFolder folder;
  write_file(folder / "a.wav", wav(1, 8000, {1, 2}));
  const auto sound = read_sound_file(folder / "a.wav");
  return sound || sound.error().code != Errc::unsupported;
}

TEST_CASE("Sound files are read at full scale, broken ones refused") {
  if (!have_sound()) {
    WARN("built without libsndfile: not tested");
    return;
  }
  const TemporaryFolder folder;
  write_file(folder / "a.wav", wav(2, 44100, {16384, -32768, 0, 1}));
  const auto sound = read_sound_file(folder / "a.wav");
  REQUIRE(sound);
  CHECK(sound->rate_hz == 44100.0);
  CHECK(sound->channels == std::vector<std::vector<double>>{{0.5, 0.0}, {-1.0, 1.0 / 32768.0}});
  write_file(folder / "b.wav", "RIFF");
  CHECK_FALSE(read_sound_file(folder / "b.wav"));
  write_file(folder / "c.wav", wav(1, 8000, {}));
  CHECK_FALSE(read_sound_file(folder / "c.wav"));
  CHECK(read_sound_file(folder / "d.wav").error().code == Errc::not_found);
}

TEST_CASE("A manifest of tables and sound files is imported, its mistakes are named by line") {
  const TemporaryFolder folder;
  write_file(folder / "one.csv", "t_s,X,Y\n0,1,2\n0.005,3,4\n0.01,5,6\n");
  write_file(folder / "two.csv", "t_s,X,Y\n0,7,8\n0.005,9,10\n");
  write_file(folder / "m.csv", "file,label,group\none.csv,felt,a\ntwo.csv,foil,b\n");
  const auto set = import_recordings(folder / "m.csv");
  REQUIRE(set);
  REQUIRE(set->recordings.size() == 2);
  CHECK(set->kind == BenchKind::unknown);
  CHECK(set->recordings[0].channels[1].name == "Y");
  CHECK(set->recordings[0].channels[1].rate_hz == 200.0);
  CHECK(set->recordings[0].samples[1] == std::vector{2.0, 4.0, 6.0});
  CHECK(set->recordings[1].group == "b");

  write_file(folder / "m2.csv", "file,label\none.csv,felt\nnone.csv,foil\n");
  const auto missing = import_recordings(folder / "m2.csv");
  REQUIRE_FALSE(missing);
  CHECK(missing.error().where.find("m2.csv:3") != std::string::npos);
  write_file(folder / "m3.csv", "file\none.csv\n");
  CHECK_FALSE(import_recordings(folder / "m3.csv"));
  // A gap of a second, and a channel with one sample in 250 s.
  write_file(folder / "hole.csv", "t_s,X\n0,1\n0.005,2\n0.01,3\n1.015,4\n1.02,5\n");
  write_file(folder / "m5.csv", "file,label\nhole.csv,felt\n");
  const auto hole = import_recordings(folder / "m5.csv");
  REQUIRE_FALSE(hole);
  CHECK(hole.error().code == Errc::parse);
  CHECK(hole.error().where.find("hole.csv") != std::string::npos);
  write_file(folder / "slow.csv", "t_s,X\n0,1\n250,2\n500,3\n");
  write_file(folder / "m6.csv", "file,label\nslow.csv,felt\n");
  const auto slow = import_recordings(folder / "m6.csv");
  REQUIRE(slow);
  CHECK(slow->recordings[0].channels[0].rate_hz == Approx(0.004));
  write_file(folder / "still.csv", "t_s,X\n0,1\n0,2\n");
  write_file(folder / "m4.csv", "file,label\nstill.csv,felt\n");
  CHECK_FALSE(import_recordings(folder / "m4.csv"));
}

TEST_CASE("A manifest of recordings is read as strictly as one of slides") {
  const TemporaryFolder folder;
  write_file(folder / "one.csv", "t_s,X\n0,1\n0.005,3\n");
  const auto complaint = [&](const std::string& manifest, const std::string& place) {
    write_file(folder / "m.csv", manifest);
    const auto set = import_recordings(folder / "m.csv");
    REQUIRE_FALSE(set);
    CHECK(set.error().code == Errc::parse);
    CHECK(set.error().where.starts_with((folder / "m.csv").string() + place));
    return set.error();
  };
  CHECK(complaint("file,label\none.csv,a\none.csv,a\n", ":3").got == "one.csv");
  CHECK(complaint("file,label\none.csv,a\n./one.csv,b\n", ":3").got == "./one.csv");
  CHECK(to_string(complaint("file,label,Group\none.csv,a,1\n", ":1")).find("Group") !=
        std::string::npos);
  CHECK(complaint("file,label\none.csv,\" \"\n", ":2").what.find("label") != std::string::npos);
  CHECK(complaint("file,label\none.csv,caf\xe9\n", ":2").expected.find("UTF-8") !=
        std::string::npos);
  complaint("file,label\n", "");
}

// A table of `samples` times in whole units of 10^-decimals seconds.
std::string table_at(double rate_hz, int samples, int decimals) {
  std::string out = "t_s,X\n";
  for (int i = 0; i < samples; ++i) {
    char time[40];
    std::snprintf(time, sizeof time, "%.*f", decimals, i / rate_hz);
    out += std::string(time) + ",1\n";
  }
  return out;
}

TEST_CASE("Tables have one rate unless their times show another") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label\na.csv,a\nb.csv,b\nc.csv,c\n");
  const auto with_last = [&](const std::string& last) {
    write_file(folder / "a.csv", table_at(400.0, 2001, 3));
    write_file(folder / "b.csv", table_at(400.0, 2002, 3));  // measured separately: 399.96 or
                                                             // 400.04
    write_file(folder / "c.csv", last);
    return import_recordings(folder / "m.csv");
  };
  const auto set = with_last(table_at(400.0, 2003, 3));
  REQUIRE(set);
  for (const Recording& r : set->recordings) CHECK(r.channels.front().rate_hz == 400.0);

  // A difference of half a hertz is more than millisecond rounding hides in five seconds. Times
  // with six decimals reveal a tenth of a hertz.
  const auto other = with_last(table_at(400.5, 2001, 3));
  REQUIRE_FALSE(other);
  CHECK(other.error().expected == "X 400.000000 Hz [1]");
  CHECK(other.error().got == "X 400.480000 Hz [1]");
  write_file(folder / "fine.csv", "file,label\na.csv,a\nb.csv,b\n");
  write_file(folder / "a.csv", table_at(400.0, 2001, 6));
  write_file(folder / "b.csv", table_at(400.1, 2001, 6));
  CHECK_FALSE(import_recordings(folder / "fine.csv"));

  // A short table hardly determines its rate. Long ones do, and may still differ from each other.
  const auto short_and_long = [&](double long_hz, double other_hz) {
    write_file(folder / "a.csv", table_at(400.0, 40, 3));
    write_file(folder / "b.csv", table_at(long_hz, 20000, 3));
    write_file(folder / "c.csv", table_at(other_hz, 20001, 3));
    return import_recordings(folder / "m.csv");
  };
  const auto settled = short_and_long(400.0, 400.0);
  REQUIRE(settled);
  for (const Recording& r : settled->recordings)
    CHECK(r.channels.front().rate_hz == Approx(400.0).margin(0.015));
  CHECK_FALSE(short_and_long(395.0, 405.0));
}

TEST_CASE("VibTac-12 needs twelve lines of numbers") {
  const TemporaryFolder folder;
  std::string lines;
  for (int t = 0; t < 12; ++t) lines += std::to_string(t) + ",1.0,2e0\n";
  for (const char* name : {"X.csv", "Y.csv", "Z.csv"}) write_file(folder / name, lines);
  const auto set = import_vibtac12(folder.path(), {"X", "Z"});
  REQUIRE(set);
  REQUIRE(set->recordings.size() == 12);
  CHECK(set->recordings[3].label == "texture04");
  CHECK(set->recordings[3].samples[0] == std::vector{3.0, 1.0, 2.0});
  CHECK(set->recordings[3].channels[1].name == "Z");
  CHECK_FALSE(import_vibtac12(folder.path(), {"Q"}));
  CHECK_FALSE(import_vibtac12(folder.path(), {"S"}));  // the folder has no sound track
  CHECK_FALSE(import_vibtac12(folder / "none", {"X"}));
  write_file(folder / "Y.csv", lines + "1,2,3\n");
  CHECK_FALSE(import_vibtac12(folder.path(), {"Y"}));
  write_file(folder / "Y.csv", lines.substr(0, lines.size() - 3) + "x\n");
  const auto odd = import_vibtac12(folder.path(), {"Y"});
  REQUIRE_FALSE(odd);
  CHECK(odd.error().where.find("Y.csv:12: field 3") != std::string::npos);
}

TEST_CASE("VibTac-12 with sound has the textures with a track alone, whatever their numbers") {
  if (!have_sound()) {
    WARN("built without libsndfile: not tested");
    return;
  }
  const TemporaryFolder folder;
  write_file(folder / "Texture10.wav", wav(1, 8000, {16384, -32768, 0}));
  write_file(folder / "Texture3.wav", wav(1, 8000, {8192, 1}));
  const auto set = import_vibtac12(folder.path(), {"S"});
  REQUIRE(set);
  CHECK(set->kind == BenchKind::real);
  REQUIRE(set->recordings.size() == 2);
  const Recording &third = set->recordings[0], &tenth = set->recordings[1];
  CHECK(third.label == "texture03");
  CHECK(third.samples == std::vector<std::vector<double>>{{0.25, 1.0 / 32768.0}});
  CHECK(tenth.label == "texture10");
  CHECK(tenth.samples == std::vector<std::vector<double>>{{0.5, -1.0, 0.0}});
  CHECK(tenth.channels == std::vector<classifier::vibro::Channel>{{"S", 8000.0, "1"}});

  std::string lines;
  for (int t = 0; t < 12; ++t) lines += std::to_string(t) + ",1.0\n";
  write_file(folder / "X.csv", lines);
  const auto both = import_vibtac12(folder.path(), {"S", "X"});
  REQUIRE(both);
  REQUIRE(both->recordings.size() == 2);
  CHECK(both->recordings[1].samples[1] == std::vector{9.0, 1.0});

  write_file(folder / "Texture4.wav", wav(1, 44100, {1, 2}));
  const auto odd = import_vibtac12(folder.path(), {"S"});
  REQUIRE_FALSE(odd);
  CHECK(odd.error().where.find("Texture4.wav") != std::string::npos);
}

// A trial with phase M from 100 ms to 200 ms of the host clock, and a sound block of four readings
// at 200 Hz every 20 ms.
Dataset campaign() {
  Dataset out;
  out.info.kind = BenchKind::simulated;
  out.info.sound = {200.0, 4};
  classifier::Trial trial;
  trial.file = "t0";
  trial.label = "felt";
  trial.taxels = 1;
  TrialRecord record;
  record.spec.repetition = 2;
  for (std::int64_t ms = 0; ms <= 300; ms += 10) {
    trial.counts.push_back(0.0);
    trial.phase.push_back(ms >= 100 && ms <= 200 ? Phase::motion : Phase::press);
    record.t_ns.push_back(ms * 1'000'000);
  }
  for (std::int64_t ms = 20; ms <= 300; ms += 20) {
    record.sound.t_ns.push_back(ms * 1'000'000);
    record.sound.device_us.push_back(static_cast<std::uint32_t>((ms - 20) * 1000));
    record.sound.lost.push_back(0);
    record.sound.clipped.push_back(0);
    for (int i = 0; i < 4; ++i) record.sound.quanta.push_back(static_cast<int>(ms) * 1'000'000);
  }
  out.trials.push_back(trial);
  out.records.push_back(record);
  return out;
}

TEST_CASE("Recordings of an altered bench are refused") {
  const TemporaryFolder folder;
  REQUIRE(write_hdf5(campaign(), folder / "d.h5"));
  const auto read = [&] {
    auto file = DatasetReader::open(folder / "d.h5");
    return file ? extract_recordings(*file) : tl::unexpected<Error>(file.error());
  };
  REQUIRE(read());
  {
    const hdf5::Handle file(H5Fopen((folder / "d.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
                            H5Fclose);
    const hdf5::Handle kind(H5Aopen(file.id(), "bench_kind", H5P_DEFAULT), H5Aclose);
    const hdf5::Handle type(H5Aget_type(kind.id()), H5Tclose);
    REQUIRE(H5Awrite(kind.id(), type.id(), "real\0\0\0\0\0\0\0\0") >= 0);
  }
  CHECK(read().error().code == Errc::corrupt);
}

TEST_CASE("Whole blocks of phase M of a campaign are used, and lost ones refused") {
  Dataset dataset = campaign();
  const auto set = extract_recordings(dataset);
  REQUIRE(set);
  CHECK(set->kind == BenchKind::simulated);
  REQUIRE(set->recordings.size() == 1);
  const Recording& r = set->recordings[0];
  CHECK(r.group == "2");
  CHECK(r.channels == std::vector<classifier::vibro::Channel>{{"S", 200.0, "Pa"}});
  // Blocks that end at 120, 140 ... 200 ms.
  REQUIRE(r.samples[0].size() == 20);
  CHECK(r.samples[0].front() == 120.0);
  CHECK(r.samples[0].back() == 200.0);

  dataset.records[0].sound.lost[7] = 1;  // ends at 160 ms
  const auto refused = extract_recordings(dataset);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where == "t0");
  dataset.records[0].sound.lost[7] = 0;
  dataset.records[0].sound.lost[2] = 1;  // before M
  CHECK(extract_recordings(dataset));

  // Blocks missing at either end of M, whether or not a later block reports the loss.
  const auto without = [](std::size_t first, std::size_t last) {
    Dataset torn = campaign();
    BlockStream& sound = torn.records[0].sound;
    const auto erase = [&](auto& of_blocks, std::size_t each) {
      of_blocks.erase(of_blocks.begin() + static_cast<std::ptrdiff_t>(first * each),
                      of_blocks.begin() + static_cast<std::ptrdiff_t>(last * each));
    };
    erase(sound.t_ns, 1);
    erase(sound.device_us, 1);
    erase(sound.lost, 1);
    erase(sound.clipped, 1);
    erase(sound.quanta, 4);
    return static_cast<bool>(extract_recordings(torn));
  };
  CHECK(without(0, 0));
  CHECK(without(0, 5));         // all before M
  CHECK_FALSE(without(5, 8));   // ending at 120, 140, 160 ms
  CHECK_FALSE(without(0, 7));   // and all before them
  CHECK_FALSE(without(8, 10));  // ending at 180, 200 ms
  CHECK_FALSE(without(8, 15));
  CHECK(without(10, 15));

  dataset.records[0].outcome = TrialOutcome::aborted;
  CHECK_FALSE(extract_recordings(dataset));
  dataset.info.sound = {};
  CHECK_FALSE(extract_recordings(dataset));
}

TEST_CASE("A hand-over takes one exploration, its repetitions dealt into groups") {
  Dataset dataset = campaign();
  dataset.records[0].spec.exploration = "V1";
  CHECK(vibration_material(dataset, "V1", {0, 1})->recordings[0].group == "2");
  CHECK(vibration_material(dataset, "V1", {0, 0})->recordings[0].group == "1");
  CHECK_FALSE(vibration_material(dataset, "V2", {0, 1}));
  CHECK(extract_recordings(dataset, "V1"));
}

}  // namespace
}  // namespace weft::daemon::recordings_test
