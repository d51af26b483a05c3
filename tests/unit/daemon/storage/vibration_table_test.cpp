// Tables of vibration with late times or missing samples.

#include <catch2/catch.hpp>
#include <cstdio>
#include <random>

#include "daemon/storage/recordings/import_recordings.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::vibration_table_test {
namespace {

using test::TemporaryFolder;
using test::write_file;

std::string table(const std::vector<double>& t_s, const std::string& line_end = "\n") {
  std::string out = "t_s,X\n";
  for (const double t : t_s) {
    char text[40];
    std::snprintf(text, sizeof text, "%.7f,1", t);
    out += text + line_end;
  }
  return out;
}

std::vector<double> even(double rate_hz, int samples = 3200) {
  std::vector<double> out;
  for (int i = 0; i < samples; ++i) out.push_back(i / rate_hz);
  return out;
}

Result<RecordingSet> imported(const TemporaryFolder& folder,
                              const std::vector<std::string>& tables) {
  std::string manifest = "file,label\n";
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const std::string name = std::to_string(i) + ".csv";
    write_file(folder / name, tables[i]);
    manifest += name + ",felt\n";
  }
  write_file(folder / "m.csv", manifest);
  return import_recordings(folder / "m.csv");
}

double rate_hz(const std::vector<double>& t_s) {
  const TemporaryFolder folder;
  const auto set = imported(folder, {table(t_s)});
  return set ? set->recordings[0].channels[0].rate_hz : 0.0;
}

// Refused with the advice to state the rate; accepted with a stated one.
void needs_a_stated_rate(const std::vector<double>& t_s) {
  const TemporaryFolder folder;
  const auto refused = imported(folder, {table(t_s)});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::parse);
  CHECK(refused.error().hint.ends_with("--rate-hz"));
  const auto set = import_recordings(folder / "m.csv", 400);
  REQUIRE(set);
  CHECK(set->recordings[0].channels[0].rate_hz == 400);
  CHECK(set->recordings[0].samples[0].size() == t_s.size());
}

TEST_CASE("samples of a table that were read late need a stated rate") {
  std::vector<double> batches, scattered = even(400), each_second;
  for (int i = 0; i < 3200; ++i) batches.push_back(i / 8 * 0.02 + i % 8 * 0.0002);
  needs_a_stated_rate(batches);
  for (int i = 0; i < 4000; ++i) each_second.push_back(i / 400 + i % 400 * 0.0002);
  needs_a_stated_rate(each_second);
  std::mt19937 engine(1);
  std::normal_distribution<double> late_s(0, 0.25 / 400);
  for (double& t : scattered) t += late_s(engine);
  needs_a_stated_rate(scattered);
}

TEST_CASE("the stated rate is that of all tables of a set") {
  const TemporaryFolder folder;
  CHECK_FALSE(imported(folder, {table(even(400)), table(even(401))}));
  const auto set = import_recordings(folder / "m.csv", 400.5);
  REQUIRE(set);
  for (const auto& recording : set->recordings) CHECK(recording.channels[0].rate_hz == 400.5);
}

TEST_CASE("samples that are missing in a table are named by the line after them") {
  const TemporaryFolder folder;
  std::vector<double> holed = even(100, 800);
  holed.erase(holed.begin() + 300, holed.begin() + 320);
  const auto error = [&](const std::string& text) { return imported(folder, {text}).error(); };
  CHECK(error(table(holed)).where.ends_with("0.csv:302"));
  CHECK(error(table(holed)).got == "0.210000 s");
  CHECK(error(table(holed, "\n\n")).where.ends_with("0.csv:602"));
  std::vector<double> one = even(100, 800);
  one.erase(one.begin() + 300);
  CHECK(error(table(one)).where.ends_with("0.csv:302"));
}

TEST_CASE("a sample that is missing in a table is found near its ends and in between") {
  for (const std::ptrdiff_t at : {3, 50, 1600, 3150, 3196}) {
    CAPTURE(at);
    std::vector<double> times = even(400);
    times.erase(times.begin() + at);
    CHECK(rate_hz(times) == 0.0);
  }
  std::vector<double> periodic = even(400);
  for (std::ptrdiff_t at = 3200 - 3200 % 512 - 1; at > 0; at -= 512)
    periodic.erase(periodic.begin() + at);
  CHECK(rate_hz(periodic) == 0.0);
}

TEST_CASE("times of a table in another unit than seconds are refused by their line") {
  const TemporaryFolder folder;
  for (const char* far : {"1.7e12", "1.7e18", "-1e300"}) {
    const Error error = imported(folder, {std::string("t_s,X\n") + far + ",1\n"}).error();
    CHECK(error.expected.find("142") != std::string::npos);
    CHECK(error.where.ends_with("0.csv:2 column t_s"));
  }
  CHECK(rate_hz({1.7e9, 1.7e9 + 0.5, 1.7e9 + 1}) == 2.0);
}

TEST_CASE("two sensors of one model are of one rate, though their clocks differ by 100 ppm") {
  const TemporaryFolder folder;
  const auto set = imported(folder, {table(even(400 * (1 + 5e-5))), table(even(400 * (1 - 5e-5)))});
  REQUIRE(set);
  CHECK(set->recordings[0].channels == set->recordings[1].channels);
  CHECK_FALSE(imported(folder, {table(even(400)), table(even(401))}));
}

TEST_CASE("a table of HapMat is one by its name in letters of either case") {
  const TemporaryFolder folder;
  write_file(folder / "Felt.CSV", "time,X\n0,1\n0.005,2\n");
  write_file(folder / "Silk.csv", "time,X\n0,1\n0.005,2\n");
  const auto set = import_hapmat(folder.path());
  REQUIRE(set);
  CHECK(set->recordings.size() == 2);
}

}  // namespace
}  // namespace weft::daemon::vibration_table_test
