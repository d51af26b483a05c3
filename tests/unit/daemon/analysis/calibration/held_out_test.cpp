// The held-out check: strokes of the plant itself pass it, strokes of another fabric do not.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/held_out.hpp"
#include "daemon/analysis/calibration/scene.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::held_out_test {

using namespace test;

namespace {

constexpr std::uint64_t held_out_seed = 4711;

HeldOutCheck check_of(std::size_t inside, std::size_t statistics) {
  HeldOutCheck out;
  out.statistics.resize(statistics);
  out.inside = inside;
  return out;
}

CalibrationOptions few_replicates() {
  CalibrationOptions out;
  out.windows = 4;
  out.held_out_replicates = 12;
  return out;
}

/// Strokes made with `held_out` values, compared with the plant of the estimates.
HeldOutCheck check(const ClothModel& model, const RecordingView& like,
                   const std::vector<double>& held_out, const CalibrationOptions& options) {
  auto scene = Scene::make(like, model);
  REQUIRE(scene);
  const auto view = scene->simulate(held_out, held_out_seed, 1);
  REQUIRE(view);
  auto out = check_held_out(*view, model, model.start(), options);
  REQUIRE(out);
  return *out;
}

const HeldOutStatistic& statistic(const HeldOutCheck& check, std::string_view name) {
  for (const HeldOutStatistic& s : check.statistics)
    if (s.real.name == name) return s;
  FAIL("no statistic " << name);
  return check.statistics.front();
}

}  // namespace

TEST_CASE("Four of five statistics inside pass, fewer or none do not") {
  CHECK(check_of(4, 5).passes());
  CHECK(check_of(8, 10).passes());
  CHECK_FALSE(check_of(7, 9).passes());
  CHECK_FALSE(check_of(0, 0).passes());
  CHECK_FALSE(check_of(0, 0).is_checked());
}

TEST_CASE("Strokes of the same plant pass, those of a rougher cloth have another modulation") {
  const RecordingView like = empty_strokes({"denim"}, 2, 2);
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  std::vector<double> rougher = model->start();
  rougher[model->find("height_um", "denim")] *= 4;
  const HeldOutCheck same = check(*model, like, model->start(), few_replicates());
  const HeldOutCheck other = check(*model, like, rougher, few_replicates());
  CHECK(same.passes());
  CHECK_FALSE(statistic(other, "modulation").is_inside);
  CHECK(statistic(other, "modulation").real.value > statistic(other, "modulation").high);
  CHECK(other.inside < same.inside);
}

TEST_CASE("The number inside is that of the statistics, whatever the number of threads") {
  const RecordingView like = empty_strokes({"denim", "felt"}, 1, 1);
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  CalibrationOptions options = few_replicates();
  options.threads = 1;
  const HeldOutCheck one = check(*model, like, model->start(), options);
  options.threads = 2;
  const HeldOutCheck two = check(*model, like, model->start(), options);
  std::size_t inside = 0;
  REQUIRE(one.statistics.size() == two.statistics.size());
  for (std::size_t i = 0; i < one.statistics.size(); ++i) {
    inside += one.statistics[i].is_inside ? 1 : 0;
    CHECK(one.statistics[i].low == two.statistics[i].low);
    CHECK(one.statistics[i].high == two.statistics[i].high);
  }
  CHECK(one.inside == inside);
}

}  // namespace weft::daemon::calibration::held_out_test
