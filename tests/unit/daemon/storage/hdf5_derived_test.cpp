// Redundant parts of a data set agree: no digest covers the first row of a trial, the sections of
// its phases and the quanta, but other programs use them.

#include <limits>

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/unit/daemon/storage/hdf5_poke.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace hdf5_derived_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

/// Three trials, one of them with blocks of sound and acceleration.
void write_small_set(const std::filesystem::path& path) {
  const auto campaign = path.string() + ".campaign";
  REQUIRE(record_campaign(campaign, 3, 20));
  auto dataset = load_campaign(campaign);
  REQUIRE(dataset);
  std::filesystem::remove(campaign);
  dataset->info.sound = {8000, 2};
  dataset->info.acceleration = {1000, 1};
  for (std::size_t i = 1; i < 3; ++i) {
    dataset->records[i].sound = {{5, 6}, {1, 2}, {0, 0}, {0, 0}, {7, 8, 9, 10}};
    dataset->records[i].acceleration = {{5}, {1}, {0}, {0}, {1, 2, 3}};
  }
  REQUIRE(write_hdf5(*dataset, path));
}

}  // namespace

TEST_CASE("a data set with trials that point at rows of others is refused with the column") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  write_small_set(path);
  REQUIRE(read_hdf5(path));
  const char* const column = GENERATE(
      "/trials/taxel_first", "/trials/device_us_first", "/trials/wrench_first",
      "/trials/stages_first", "/trials/sound_blocks_first", "/trials/acceleration_blocks_first");
  poke(path, column, 2, std::uint64_t{0});
  const auto refused = read_hdf5(path);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::corrupt);
  CHECK(refused.error().where == path.string() + ": " + column);
}

TEST_CASE("runs of phases are those of the samples' phases") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  write_small_set(path);
  SECTION("of another trial") {
    poke(path, "/phases/trial", 1, std::uint32_t{2});
  }
  SECTION("another phase") {
    poke(path, "/phases/phase", 1, std::uint8_t{'S'});
  }
  SECTION("another row") {
    poke(path, "/phases/first", 1, std::uint64_t{0});
  }
  SECTION("another length") {
    poke(path, "/phases/samples", 1, std::uint64_t{0});
  }
  const auto refused = read_hdf5(path);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::corrupt);
  CHECK(refused.error().where == path.string() + ": /phases");
}

TEST_CASE("a quantum is what its column is written in") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  write_small_set(path);
  SECTION("force") {
    poke_attribute(path, "/wrench/quanta", "per_unit", 1e3);
  }
  SECTION("sound") {
    poke_attribute(path, "/sound/quanta", "per_unit", 1e3);
  }
  SECTION("acceleration") {
    poke_attribute(path, "/acceleration/quanta", "per_unit", 1e3);
  }
  SECTION("position") {
    poke(path, "/stages/per_unit", 0, 1.0);
  }
  CHECK(read_hdf5(path).error().code == Errc::corrupt);
}

TEST_CASE("a rate is a finite number that is not negative") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  write_small_set(path);
  const char* const group = GENERATE("/taxel", "/wrench", "/stages", "/sound");
  const double bad = GENERATE(-5.0, std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::quiet_NaN());
  poke_attribute(path, group, "rate_hz", bad);
  CHECK(read_hdf5(path).error().code == Errc::corrupt);
  poke_attribute(path, group, "rate_hz", 100);
  CHECK(read_hdf5(path));
}

TEST_CASE("files of writers that store nothing twice are read") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  write_small_set(path);
  for (const char* object :
       {"/phases", "/trials/taxel_first", "/trials/device_us_first", "/trials/wrench_first",
        "/trials/stages_first", "/trials/sound_blocks_first", "/trials/acceleration_blocks_first",
        "/stages/per_unit"})
    take_out(path, object);
  for (const char* column : {"/wrench/quanta", "/sound/quanta", "/acceleration/quanta"})
    take_out(path, column, "per_unit");
  CHECK(read_hdf5(path));
}

}  // namespace hdf5_derived_test
