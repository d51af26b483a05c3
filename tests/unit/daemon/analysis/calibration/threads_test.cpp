// A calibration writes the same bytes with one thread and with two. SIMULATED.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/analysis/calibration/write_fabrics.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::threads_test {

using namespace test;

namespace {

CalibrationOptions small_options(std::size_t threads) {
  CalibrationOptions out;
  out.threads = threads;
  out.windows = 4;
  out.starts = 1;
  out.evaluations = 6;
  out.common_evaluations = 8;
  out.bootstrap_draws = 20;
  out.replicates = 3;
  out.held_out_replicates = 3;
  return out;
}

/// Table and result as text.
std::string written(const RecordingView& view, std::size_t threads) {
  const auto result = calibrate(view, view, table(), small_options(threads));
  REQUIRE(result);
  const auto cloths = calibrated_table(table_text(), *result, {});
  REQUIRE(cloths);
  return cloths->dump() + calibration_json(*result, {}).dump();
}

}  // namespace

TEST_CASE("One thread and two write the same table and the same result") {
  if (lacks_nlopt()) return;
  const RecordingView like = empty_strokes({"denim", "felt"}, 2);
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  auto scene = Scene::make(like, *model);
  REQUIRE(scene);
  const auto view = scene->simulate(model->start(), 99, 1);
  REQUIRE(view);
  CHECK(written(*view, 1) == written(*view, 2));
}

}  // namespace weft::daemon::calibration::threads_test
