#include <catch2/catch.hpp>
#include <set>

#include "daemon/storage/dataset/import.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace icub20_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

constexpr std::size_t steps = 5, taxels = 60, triangles = 6;

// Value of taxel `c` in frame `t`.
double felt(std::size_t t, std::size_t c) {
  return 100.0 * static_cast<double>(t) + static_cast<double>(c);
}

std::string header() {
  std::string out = "sample,label,fold,t";
  for (std::size_t c = 1; c <= taxels; ++c) out += ",tx" + std::to_string(c);
  return out + "\n";
}

// A stroke in the table's form: the frames' triangles in the order of time, written as six series
// of `steps` groups, and these as columns.
std::string slide(const std::string& names) {
  std::vector<std::vector<double>> groups;
  for (std::size_t t = 0; t < steps; ++t)
    for (std::size_t k = 0; k < triangles; ++k) {
      auto& group = groups.emplace_back();
      for (std::size_t c = 0; c < 10; ++c) group.push_back(felt(t, 10 * k + c));
    }
  std::string out;
  for (std::size_t j = 0; j < steps; ++j) {
    out += names + "," + std::to_string(j);
    for (std::size_t i = 0; i < triangles; ++i)
      for (const double value : groups[steps * i + j])
        out += "," + std::to_string(static_cast<int>(value));
    out += "\n";
  }
  return out;
}

// Correlation of a taxel's counts with its own one sample later, over all strokes and taxels.
double continuity(const Dataset& dataset) {
  double together = 0.0, alone = 0.0;
  for (const classifier::Trial& trial : dataset.trials)
    for (std::size_t c = 0; c < trial.taxels; ++c) {
      const auto n = static_cast<double>(trial.samples());
      double mean = 0.0;
      for (std::size_t j = 0; j < trial.samples(); ++j) mean += trial.row(j)[c] / n;
      for (std::size_t j = 0; j < trial.samples(); ++j) {
        const double value = trial.row(j)[c] - mean;
        alone += value * value / n;
        if (j > 0) together += value * (trial.row(j - 1)[c] - mean) / (n - 1.0);
      }
    }
  return together / alone;
}

}  // namespace

TEST_CASE("slides of the icub20 table come in the order of time, or as filed") {
  const TemporaryFolder folder;
  write_file(folder / "icub20.csv", header() + slide("7,16,0") + slide("8,3,2"));
  const auto dataset = import_icub20(folder / "icub20.csv");
  REQUIRE(dataset);
  REQUIRE(check(*dataset));
  REQUIRE(dataset->trials.size() == 2);
  CHECK(dataset->info.kind == BenchKind::real);
  CHECK(dataset->info.taxel_rate_hz == Approx(50.0));
  CHECK(dataset->trials[0].file == "7");
  CHECK(dataset->trials[0].label == "16");
  CHECK(dataset->trials[1].group == "2");
  CHECK(dataset->records[1].t_ns.back() == 80'000'000);
  const auto filed = import_icub20(folder / "icub20.csv", Icub20Order::filed);
  REQUIRE(filed);
  for (const classifier::Trial& trial : dataset->trials) {
    REQUIRE(trial.samples() == steps);
    CHECK(trial.phase.back() == Phase::motion);
    for (std::size_t t = 0; t < steps; ++t)
      for (std::size_t c = 0; c < taxels; ++c) CHECK(trial.row(t)[c] == felt(t, c));
  }
  CHECK(filed->info.name != dataset->info.name);
  CHECK(filed->trials[0].row(1)[0] == felt(0, 10));  // the second triangle of the first frame
  CHECK(filed->trials[0].row(0)[10] == felt(0, 50));
}

TEST_CASE("an icub20 table that is none is refused with its line") {
  const TemporaryFolder folder;
  const auto file = folder / "icub20.csv";
  const auto where = [&](const std::string& text) {
    write_file(file, text);
    return import_icub20(file).error().where;
  };
  const std::string first = file.string() + ":1";
  CHECK(where("sample,label,fold,tx1\n0,1,0,5\n") == first);      // no steps
  CHECK(where("sample,label,fold,t,tx1\n0,1,0,0,5\n") == first);  // no whole triangle
  CHECK(where("sample,label,fold,t,ch1\n0,1,0,0,5\n") == first);  // no taxels
  CHECK(where(header()) == first);                                // no slides
  const std::string whole = header() + slide("7,16,0");
  const auto line = [&](std::size_t n) { return file.string() + ":" + std::to_string(n); };
  CHECK(where(whole + slide("7,16,0")) == line(7));  // twice
  CHECK(where(whole + slide("8,3,2").substr(slide("8,3,2").find('\n') + 1)) == line(7));
  CHECK(where(whole + slide("8,3,2") + slide("7,16,0")) == line(12));  // again after another one
  for (const char* names : {",3,2", "8,,2", "8,3,", "8,\xff,2", "8,3,\xff", "\xff,3,2"})
    CHECK(where(whole + slide(names)) == line(7));
  std::string other = whole;
  other.replace(other.find("\n7,16,0,1") + 3, 2, "17");
  CHECK(where(other) == line(3));
  CHECK(import_icub20(folder / "absent.csv").error().code == Errc::not_found);
}

TEST_CASE("a slide that lost a step cannot be put in the order of time, but read as filed") {
  const TemporaryFolder folder;
  const auto file = folder / "icub20.csv";
  const std::string cut = slide("7,16,0").substr(0, slide("7,16,0").rfind("\n7,") + 1);
  for (const std::string& text :
       {slide("6,1,0") + cut, cut + slide("8,1,0"), slide("6,1,0") + cut + slide("8,1,0")}) {
    write_file(file, header() + text);
    const auto put = import_icub20(file);
    REQUIRE_FALSE(put);
    CHECK(put.error().what.find("steps") != std::string::npos);
    CHECK(put.error().where.starts_with(file.string() + ":"));
    CHECK(import_icub20(file, Icub20Order::filed));
  }
}

TEST_CASE("the real icub20 set is read whole, and its skin slides on from frame to frame") {
  const std::filesystem::path path = WEFT_SHARED_DIR "/data/icub20/icub20.csv";
  if (!std::filesystem::exists(path)) {
    WARN("skipped: no recordings at " << path);
    return;
  }
  const auto dataset = import_icub20(path);
  REQUIRE(dataset);
  REQUIRE(check(*dataset));
  std::set<std::string> labels, groups;
  for (const classifier::Trial& trial : dataset->trials) {
    labels.insert(trial.label);
    groups.insert(trial.group);
    CHECK(trial.samples() == 75);
  }
  CHECK(dataset->trials.size() == 800);
  CHECK(labels.size() == 20);
  CHECK(groups == std::set<std::string>{"0", "1", "2", "3"});
  CHECK(continuity(*dataset) > 0.9);
  CHECK(continuity(*import_icub20(path, Icub20Order::filed)) < 0.0);
}

}  // namespace icub20_test
