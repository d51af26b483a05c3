// Contents of a manifest beside file, label and group: the bench, and columns of any name.
#include <catch2/catch.hpp>
#include <numbers>

#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recordings/import_recordings.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace manifest_columns_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

// Two files; each is a trial, a recording and, as a matrix, an imprint.
struct TwoFiles {
  TemporaryFolder folder;

  explicit TwoFiles(const std::string& manifest) {
    write_file(folder / "m.csv", manifest);
    write_file(folder / "a.csv", "t_s,ch1\n0,1\n0.01,2\n0.02,4\n");
    write_file(folder / "b.csv", "t_s,ch1\n0,5\n0.01,2\n0.02,3\n");
    write_file(folder / "a.txt", "1,2\n3,4\n");
    write_file(folder / "b.txt", "4,3\n2,2\n");
  }
  [[nodiscard]] Result<Dataset> trials(std::optional<BenchKind> bench = {}) const {
    return import_manifest(folder / "m.csv", 0, bench);
  }
  [[nodiscard]] Result<RecordingSet> recordings(std::optional<BenchKind> bench = {}) const {
    return import_recordings(folder / "m.csv", 0, bench);
  }
  [[nodiscard]] Result<Dataset> imprints(std::optional<BenchKind> bench = {}) const {
    return import_imprints(folder / "m.csv", bench);
  }
};

constexpr const char* plain = "file,label\na.csv,felt\nb.csv,foil\n";
constexpr const char* simulated = "file,bench,label\na.csv,simulated,felt\nb.csv,simulated,foil\n";
constexpr const char* plain_images = "file,label\na.txt,felt\nb.txt,foil\n";
constexpr const char* real_images = "file,label,bench\na.txt,felt,real\nb.txt,foil,real\n";

}  // namespace

TEST_CASE("an import is of the bench that its manifest or its caller states, else of none known") {
  const TwoFiles none(plain), one(simulated);
  CHECK(none.trials()->info.kind == BenchKind::unknown);
  CHECK(none.trials(BenchKind::real)->info.kind == BenchKind::real);
  CHECK(one.trials()->info.kind == BenchKind::simulated);
  CHECK(one.trials(BenchKind::simulated)->info.kind == BenchKind::simulated);
  CHECK(none.recordings()->kind == BenchKind::unknown);
  CHECK(none.recordings(BenchKind::real)->kind == BenchKind::real);
  CHECK(one.recordings()->kind == BenchKind::simulated);
  const TwoFiles images(plain_images), real(real_images);
  CHECK(images.imprints()->info.kind == BenchKind::unknown);
  CHECK(images.imprints(BenchKind::simulated)->info.kind == BenchKind::simulated);
  CHECK(real.imprints()->info.kind == BenchKind::real);
}

TEST_CASE("the bench is kept in the file, by its digest, and its default changes no digest") {
  const TwoFiles none(plain), one(simulated);
  REQUIRE(write_hdf5(*one.trials(), one.folder / "m.h5"));
  CHECK(read_hdf5(one.folder / "m.h5")->info.kind == BenchKind::simulated);
  CHECK(dataset_sha256(*one.trials()) == dataset_sha256(*none.trials(BenchKind::simulated)));
  CHECK(dataset_sha256(*one.trials()) != dataset_sha256(*none.trials()));
  CHECK(dataset_sha256(*none.trials()) == dataset_sha256(*none.trials(BenchKind::unknown)));
  REQUIRE(write_recordings(*one.recordings(), one.folder / "r.h5"));
  CHECK(read_recordings(one.folder / "r.h5")->kind == BenchKind::simulated);
}

TEST_CASE("several benches, another than stated, and other words are refused with their line") {
  const auto refused = [](const Result<Dataset>& set, const std::string& line) {
    REQUIRE_FALSE(set);
    CHECK(set.error().code == Errc::parse);
    CHECK(set.error().where.ends_with(line));
  };
  refused(TwoFiles("file,label,bench\na.csv,felt,real\nb.csv,foil,simulated\n").trials(),
          "m.csv:3");
  refused(TwoFiles("file,label,bench\na.csv,felt,real\nb.csv,foil,\n").trials(), "m.csv:3");
  refused(TwoFiles("file,label,bench\na.csv,felt,Real\nb.csv,foil,Real\n").trials(), "m.csv:2");
  refused(TwoFiles(simulated).trials(BenchKind::real), "m.csv:2");
  refused(TwoFiles(real_images).imprints(BenchKind::unknown), "m.csv:2");
  const auto recordings = TwoFiles(simulated).recordings(BenchKind::real);
  REQUIRE_FALSE(recordings);
  CHECK(recordings.error().where.ends_with("m.csv:2"));
}

namespace {

constexpr const char* columns =
    "file,session,label,day\na.csv,\"Mo, early\",felt,1\nb.csv,Di,foil,1\n";
constexpr const char* other_order =
    "day,file,label,session\n1,a.csv,felt,\"Mo, early\"\n1,b.csv,foil,Di\n";
using Values = std::vector<std::string>;
using Counts = std::map<std::string, std::size_t>;

}  // namespace

TEST_CASE("further columns of a manifest are kept with each trial, through its file") {
  const TwoFiles files(columns);
  const auto set = files.trials();
  REQUIRE(set);
  CHECK(set->info.group_columns == Values{"day", "session"});
  CHECK(set->records[0].spec.group_values == Values{"1", "Mo, early"});
  CHECK(count_values(list_group_columns(*set)) == Counts{{"day", 1}, {"session", 2}});
  CHECK(format_columns(list_group_columns(*set)) == "day: 1 value, session: 2 values");
  REQUIRE(write_hdf5(*set, files.folder / "a.h5"));
  const auto again = read_hdf5(files.folder / "a.h5");
  REQUIRE(again);
  CHECK(again->info == set->info);
  CHECK(again->records[1].spec.group_values == Values{"1", "Di"});
  REQUIRE(write_hdf5(*again, files.folder / "b.h5"));
  CHECK(read_file(files.folder / "a.h5") == read_file(files.folder / "b.h5"));
}

TEST_CASE("the order of a manifest's columns makes no other file, their values do") {
  const TwoFiles one(columns), two(other_order), none(plain);
  REQUIRE(write_hdf5(*one.trials(), one.folder / "m.h5"));
  REQUIRE(write_hdf5(*two.trials(), two.folder / "m.h5"));
  CHECK(read_file(one.folder / "m.h5") == read_file(two.folder / "m.h5"));
  CHECK(dataset_sha256(*one.trials()) != dataset_sha256(*none.trials()));
  auto changed = one.trials();
  changed->records[0].spec.group_values[1] = "Mi";
  CHECK(dataset_sha256(*changed) != dataset_sha256(*one.trials()));
  changed->records[0].spec.group_values.pop_back();
  CHECK_FALSE(check(*changed));
}

TEST_CASE("recordings and imprints keep further columns too") {
  const TwoFiles files(columns);
  const auto set = files.recordings();
  REQUIRE(set);
  CHECK(set->recordings[0].group_values == Values{"1", "Mo, early"});
  REQUIRE(write_recordings(*set, files.folder / "r.h5"));
  const auto again = read_recordings(files.folder / "r.h5");
  REQUIRE(again);
  CHECK(again->group_columns == Values{"day", "session"});
  CHECK(again->recordings[1].group_values == Values{"1", "Di"});
  CHECK(group_labels(*again, "session").value() == Values{"Mo, early", "Di"});
  CHECK(recordings_sha256(*set) != recordings_sha256(*TwoFiles(plain).recordings()));
  const TwoFiles images("file,label,piece\na.txt,felt,p 1\nb.txt,foil,p 2\n");
  CHECK(group_labels(*images.imprints(), "piece").value() == Values{"p 1", "p 2"});
}

TEST_CASE("files of one recording agree on its further columns") {
  const auto set = [](const char* second) {
    const TwoFiles files("file,label,recording,day\na.csv,felt,r,1\nb.csv,felt,r," +
                         std::string(second) + "\n");
    write_file(files.folder / "b.csv", "t_s,ch2\n0,5\n0.01,2\n0.02,3\n");
    return files.recordings();
  };
  CHECK(set("1")->recordings.front().channels.size() == 2);
  REQUIRE_FALSE(set("2"));
  CHECK(set("2").error().where.ends_with("m.csv:3"));
}

TEST_CASE("groups are labels of a column, and an unknown one is refused with what was meant") {
  const TwoFiles files(
      "file,label,group,session,empty,piece\na.csv,felt,g,x,,1\nb.csv,foil,h,y,1,2\n");
  const auto set = files.trials();
  REQUIRE(set);
  CHECK(group_labels(*set, "recorded").value() == Values{"g", "h"});
  CHECK(group_labels(*set, "session").value() == Values{"x", "y"});
  CHECK(group_labels(*set, "piece").value() == Values{"1", "2"});
  CHECK(group_labels(*set, "sesion").error().code == Errc::not_found);
  CHECK(group_labels(*set, "sesion").error().hint.find("session") != std::string::npos);
  CHECK(group_labels(*set, "mounting").error().code == Errc::not_found);
  const auto empty = group_labels(*set, "empty");
  REQUIRE_FALSE(empty);
  CHECK(empty.error().code == Errc::unsupported);
  CHECK(empty.error().where == "a.csv");
  CHECK(group_labels(*TwoFiles(columns).trials(), "day").error().code == Errc::unsupported);
}

TEST_CASE("a column with an ambiguous name or without a name is refused") {
  for (const char* name : {"Group", "BENCH", "Piece", "recorded", "recording", "\"\"", "\" \""}) {
    CAPTURE(name);
    const auto set =
        TwoFiles("file,label," + std::string(name) + "\na.csv,felt,1\nb.csv,foil,1\n").trials();
    REQUIRE_FALSE(set);
    CHECK(set.error().code == Errc::parse);
    CHECK(set.error().where.ends_with("m.csv:1"));
  }
  CHECK_FALSE(TwoFiles("file,label,day\na.csv,felt," + std::string(5000, 'x') + "\nb.csv,foil,1\n")
                  .trials());
}

TEST_CASE("the factors of a sweep are group columns, in SI with nine digits") {
  const TwoFiles files(plain);
  auto set = files.trials();
  REQUIRE(set);
  set->info.factors = {"speed_mps", "direction_rad"};
  set->records[0].spec.factors = {0.02, 45 * std::numbers::pi / 180};
  set->records[1].spec.factors = {0.02, 0};
  CHECK(*group_labels(*set, "direction_rad") == Values{"0.785398163", "0"});
  const auto speeds = group_labels(*set, "speed_mps");
  REQUIRE_FALSE(speeds);
  CHECK(speeds.error().what == "too few values in group column speed_mps");
}

}  // namespace manifest_columns_test
