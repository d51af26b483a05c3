#include <catch2/catch.hpp>
#include <set>

#include "daemon/storage/dataset/import.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace fabricslide_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

std::string stroke(int channels = 16) {
  std::string header = "timestamp, proximity1, proximity2";
  std::string first = "1000,0,65535";
  std::string second = "1028,0,65535";
  for (int k = 1; k <= channels; ++k) {
    header.append(", channel").append(std::to_string(k));
    first.append(",").append(std::to_string(10 * k));
    second.append(",").append(std::to_string(10 * k + 1));
  }
  return header + "\n" + first + "\n" + second + "\n";
}

}  // namespace

TEST_CASE("names of the public layout give fabric and repetition, in a fixed order") {
  const TemporaryFolder folder;
  write_file(folder / "Denim_F120_V-10mmps_1.csv", stroke());
  write_file(folder / "Denim_F120_V10mmps_0.CSV", stroke());
  write_file(folder / "Beige_Cotton_F250_V-150mmps_0.csv", stroke());
  write_file(folder / "LICENSE", "not data");
  const auto dataset = import_fabricslide(folder.path());
  REQUIRE(dataset);
  REQUIRE(check(*dataset));
  REQUIRE(dataset->trials.size() == 3);
  CHECK(dataset->info.kind == BenchKind::real);
  CHECK(dataset->info.taxel_rate_hz == Approx(1 / 0.028));
  CHECK(dataset->trials[0].label == "Beige_Cotton");
  CHECK(dataset->trials[1].group == "1");
  CHECK(dataset->records[1].spec.repetition == 1);
  CHECK(dataset->trials[2].file == "Denim_F120_V10mmps_0.CSV");
  CHECK(dataset->trials[0].row(1)[15] == 161);
  CHECK(dataset->trials[0].phase[0] == Phase::motion);
  CHECK(dataset->records[0].t_ns[1] - dataset->records[0].t_ns[0] == 28000000);
}

TEST_CASE("fabric and grip of the public layout are one mounting of the fabric's only piece") {
  const TemporaryFolder folder;
  for (const char* name : {"Denim_F120_V-10mmps_0.csv", "Denim_F120_V10mmps_1.csv",
                           "Denim_F250_V10mmps_0.csv", "Silk_F250_V10mmps_0.csv"})
    write_file(folder / name, stroke());
  const auto dataset = import_fabricslide(folder.path());
  REQUIRE(dataset);
  std::vector<std::uint32_t> mountings;
  for (const TrialRecord& record : dataset->records) {
    CHECK(record.spec.place.piece == 1);
    CHECK(record.spec.place.patch == 0);  // the files do not state it
    mountings.push_back(record.spec.place.mounting);
  }
  CHECK(mountings == std::vector<std::uint32_t>{1, 1, 2, 1});
}

TEST_CASE("groups are repetitions, grip set-points or speeds whatever their direction") {
  const TemporaryFolder folder;
  write_file(folder / "Denim_F120_V-10mmps_1.csv", stroke());
  write_file(folder / "Denim_F250_V10mmps_0.csv", stroke());
  const auto groups = [&](FabricslideGroup group) {
    const auto dataset = import_fabricslide(folder.path(), "*", group);
    return std::vector{dataset->trials[0].group, dataset->trials[1].group};
  };
  CHECK(groups(FabricslideGroup::repetition) == std::vector<std::string>{"1", "0"});
  CHECK(groups(FabricslideGroup::pressure) == std::vector<std::string>{"120", "250"});
  CHECK(groups(FabricslideGroup::speed) == std::vector<std::string>{"10", "10"});
}

TEST_CASE("a filter chooses by name, and one that matches nothing is an error") {
  const TemporaryFolder folder;
  write_file(folder / "Denim_F120_V-10mmps_1.csv", stroke());
  write_file(folder / "Denim_F120_V-100mmps_1.csv", stroke());
  CHECK(import_fabricslide(folder.path(), "*_V-10mmps_*")->trials.size() == 1);
  CHECK(import_fabricslide(folder.path(), "*_V-10*")->trials.size() == 2);
  CHECK(import_fabricslide(folder.path(), "Silk*").error().code == Errc::not_found);
  CHECK(import_fabricslide(folder / "absent").error().code == Errc::not_found);
}

TEST_CASE("files that do not follow the public layout are named") {
  const TemporaryFolder folder;
  const auto file = folder / "Denim_F120_V-10mmps_0.csv";
  const auto where = [&] { return import_fabricslide(folder.path()).error().where; };
  write_file(file, stroke(15));
  CHECK(where() == file.string() + ":1");
  write_file(file, stroke() + "1056,0,65535,1,2");
  CHECK(where() == file.string() + ":4");
  write_file(file, "t_s,ch1\n0,1\n");
  CHECK(where() == file.string() + ":1");
  write_file(file, stroke());
  write_file(folder / "notes.csv", "a,b\n");
  CHECK(where() == "notes.csv");
}

TEST_CASE("the real fabricslide set is read whole") {
  const std::filesystem::path folder = WEFT_SHARED_DIR "/data/fabricslide";
  if (!std::filesystem::exists(folder)) {
    WARN("skipped: no recordings at " << folder);
    return;
  }
  const auto dataset = import_fabricslide(folder);
  REQUIRE(dataset);
  REQUIRE(check(*dataset));
  std::set<std::string> labels;
  std::set<std::string> groups;
  std::size_t samples = 0;
  for (const classifier::Trial& trial : dataset->trials) {
    labels.insert(trial.label);
    groups.insert(trial.group);
    samples += trial.samples();
  }
  CHECK(dataset->trials.size() == 644);
  CHECK(labels.size() == 7);
  CHECK(groups == std::set<std::string>{"0", "1"});
  CHECK(samples == 445915 - 644);  // lines minus headers, by wc
  CHECK(dataset->info.taxel_rate_hz == Approx(35.7).epsilon(0.02));
}

}  // namespace fabricslide_test
