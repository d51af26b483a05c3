// Blocks of acceleration and sound in campaign files and data sets.

#include <catch2/catch.hpp>
#include <cstdlib>
#include <limits>

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace vibration_record_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

/// Value `k` of block `i`: a whole number of quanta that a mix-up would change.
double value_of(std::uint32_t trial, std::uint32_t i, std::size_t k) {
  return (1000.0 * trial + 100.0 * i + static_cast<double>(k)) / 1e6;
}

/// Blocks of 2 readings of three axes and of 5 of sound; block 3 is missing before the fourth.
Status record_blocks(Recorder& recorder, std::uint32_t trial, std::uint32_t blocks) {
  for (std::uint32_t i = 0; i < blocks; ++i) {
    std::array<double, 6> shaken{};
    std::array<double, 5> received{};
    for (std::size_t k = 0; k < 6; ++k) shaken[k] = value_of(trial, i, k);
    for (std::size_t k = 0; k < 5; ++k) received[k] = -value_of(trial, i, k);
    const std::uint32_t lost = i == 3 ? 1 : 0;
    const Stamp stamp{at_ms(100000 * trial + 20 * i), i + (i >= 3 ? 1u : 0u), lost};
    auto done = recorder.acceleration(stamp, {shaken, 200, 20000 * i, i % 2});
    if (done) done = recorder.sound(stamp, {received, 8000, 20000 * i + 7, 0});
    if (!done) return done;
  }
  return {};
}

Dataset recorded(const std::filesystem::path& path, bool vibrations) {
  auto recorder = Recorder::create(path, small_header()).value();
  for (std::uint32_t trial = 0; trial < 3; ++trial) {
    REQUIRE(recorder.begin_trial(small_spec(trial), at_ms(100000 * trial)));
    REQUIRE(record_samples(recorder, trial, 20));
    if (vibrations && trial != 1) REQUIRE(record_blocks(recorder, trial, 6));
    REQUIRE(recorder.end_trial(TrialOutcome::complete, {0.05, 0.99}, at_ms(100000 * trial + 1)));
  }
  REQUIRE(recorder.finish());
  return load_campaign(path).value();
}

}  // namespace

TEST_CASE("blocks come back from the campaign file as they were recorded") {
  const TemporaryFolder folder;
  const Dataset data = recorded(folder / "c.weft", true);
  REQUIRE(check(data));
  CHECK(data.info.acceleration == BlockFormat{200, 2});
  CHECK(data.info.sound == BlockFormat{8000, 5});
  CHECK(data.records[1].acceleration.blocks() == 0);
  const TrialRecord& record = data.records[2];
  REQUIRE(record.acceleration.blocks() == 6);
  REQUIRE(record.sound.blocks() == 6);
  CHECK(record.acceleration.lost == std::vector<std::uint32_t>{0, 0, 0, 1, 0, 0});
  CHECK(record.acceleration.clipped == std::vector<std::uint32_t>{0, 1, 0, 1, 0, 1});
  for (std::uint32_t i = 0; i < 6; ++i) {
    CHECK(record.sound.t_ns[i] == ns_of(at_ms(200000 + 20 * i)));
    CHECK(record.sound.device_us[i] == 20000 * i + 7);
    for (std::uint32_t k = 0; k < 6; ++k)
      CHECK(record.acceleration.quanta[6 * i + k] == static_cast<int>(2000 + 100 * i + k));
    for (std::uint32_t k = 0; k < 5; ++k)
      CHECK(record.sound.quanta[5 * i + k] == -static_cast<int>(2000 + 100 * i + k));
  }
}

TEST_CASE("a data set with vibrations goes through HDF5 unchanged, and h5py finds its digests") {
  const TemporaryFolder folder;
  const Dataset data = recorded(folder / "c.weft", true);
  const std::string digest = write_hdf5(data, folder / "d.h5").value();
  const Dataset back = read_hdf5(folder / "d.h5").value();
  CHECK(same_content(data, back));
  CHECK(dataset_sha256(back) == digest);
  Dataset altered = data;
  altered.records[0].sound.quanta[3] += 1;
  CHECK(dataset_sha256(altered) != digest);
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0) {
    WARN("skipped: /usr/bin/python3 has no h5py (Debian: python3-h5py)");
    return;
  }
  const std::string command = "/usr/bin/python3 " WEFT_SOURCE_DIR
                              "/tests/unit/daemon/storage/verify_dataset.py " +
                              (folder / "d.h5").string() + " >/dev/null";
  CHECK(std::system(command.c_str()) == 0);
}

TEST_CASE("a campaign without vibrations has neither their table nor their groups") {
  const TemporaryFolder folder;
  const Dataset data = recorded(folder / "c.weft", false);
  CHECK(data.info.sound == BlockFormat{});
  auto database = sqlite::Database::open(folder / "c.weft", sqlite::Mode::read_only).value();
  auto query =
      database.prepare("SELECT count(*) FROM sqlite_master WHERE name = 'block_stream'").value();
  REQUIRE(query.step().value());
  CHECK(query.integer(0) == 0);
  REQUIRE(write_hdf5(data, folder / "d.h5"));
  CHECK(read_hdf5(folder / "d.h5").value().info.acceleration == BlockFormat{});
}

TEST_CASE(
    "blocks that cannot be, or are unlike the first, are refused and leave the trial usable") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header()).value();
  std::array<double, 6> values{1, 2, 3, 4, 5, 6};
  CHECK(recorder.sound({}, {values, 8000, 0, 0}).error().code == Errc::wrong_state);
  REQUIRE(recorder.begin_trial(small_spec(0), at_ms(0)));
  REQUIRE(record_samples(recorder, 0, 4));
  const auto four = std::span<const double>(values).first(4);
  CHECK(recorder.sound({}, {{}, 8000, 0, 0}).error().code == Errc::invalid_argument);
  CHECK(recorder.sound({}, {values, 0, 0, 0}).error().code == Errc::invalid_argument);
  CHECK(recorder.acceleration({}, {four, 200, 0, 0}).error().code == Errc::invalid_argument);
  REQUIRE(recorder.sound({at_ms(0), 0, 0}, {values, 8000, 0, 0}));
  CHECK(recorder.sound({at_ms(1), 1, 0}, {four, 8000, 0, 0}).error().code ==
        Errc::invalid_argument);
  CHECK(recorder.sound({at_ms(1), 1, 0}, {values, 4000, 0, 0}).error().code ==
        Errc::invalid_argument);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 3000.0, -1e300}) {
    values[2] = bad;
    CHECK(recorder.sound({at_ms(1), 1, 0}, {values, 8000, 0, 0}).error().code == Errc::range);
  }
  values[2] = 3;
  REQUIRE(recorder.sound({at_ms(1), 1, 0}, {values, 8000, 0, 0}));
  REQUIRE(recorder.end_trial(TrialOutcome::complete, {}, at_ms(1)));
  REQUIRE(recorder.finish());
  CHECK(load_campaign(folder / "c.weft").value().records[0].sound.blocks() == 2);
}

}  // namespace vibration_record_test
