// What a manifest tells beside file, label and group: the bench.
#include <catch2/catch.hpp>

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

// Two files that are a trial each, a recording each and, as matrices, an imprint each.
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

}  // namespace manifest_columns_test
