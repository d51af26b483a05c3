// The search, and a calibration on strokes simulated with known parameters.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/analysis/calibration/minimise.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::fit_test {

using namespace test;

namespace {

constexpr std::uint64_t recorded_seed = 99;  // of another piece than the fit simulates

CalibrationOptions small_options() {
  CalibrationOptions out;
  out.windows = 6;
  out.starts = 1;
  out.evaluations = 12;
  out.joint_evaluations = 16;
  out.bootstrap_draws = 50;
  out.replicates = 6;
  out.held_out_replicates = 4;
  return out;
}

/// Strokes of one cloth with a known height, and no common mode.
struct Recorded {
  RecordingView view;
  double height_um;
};

Recorded record(std::uint32_t mountings, std::uint32_t repetitions) {
  const RecordingView like = empty_strokes({"denim"}, mountings, repetitions);
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  std::vector<double> values = model->start();
  const std::size_t height = model->find("height_um", "denim");
  values[height] *= 0.5;
  values[model->find("common_mode")] = 1e-5;
  auto scene = Scene::make(like, *model);
  REQUIRE(scene);
  auto view = scene->simulate(values, recorded_seed, 1);
  REQUIRE(view);
  return {std::move(*view), values[height]};
}

const CalibratedParameter& parameter(const CalibrationResult& result, std::string_view name) {
  for (const CalibratedParameter& p : result.parameters)
    if (p.parameter.name == name) return p;
  FAIL("no parameter " << name);
  return result.parameters.front();
}

}  // namespace

TEST_CASE("Sobol's points are the published ones") {
  CHECK(sobol_point(1, 3) == std::vector<double>{0.5, 0.5, 0.5});
  CHECK(sobol_point(2, 3) == std::vector<double>{0.75, 0.25, 0.25});
  CHECK(sobol_point(3, 3) == std::vector<double>{0.25, 0.75, 0.75});
  CHECK(sobol_point(4, 3) == std::vector<double>{0.375, 0.375, 0.625});
}

TEST_CASE("A minimum is found inside and at the bounds, or NLopt is named") {
  const Cost cost = [](std::span<const double> x) {
    return 100 * ((x[0] - 0.3) * (x[0] - 0.3) + (x[1] - 1.4) * (x[1] - 1.4));
  };
  const auto found = minimise_from_many(cost, std::vector<double>{0.8, 0.1}, 3, 40);
  if (!has_nlopt()) {
    REQUIRE_FALSE(found);
    CHECK(found.error().code == Errc::unsupported);
    return;
  }
  REQUIRE(found);
  CHECK(found->at[0] == Approx(0.3).margin(0.01));
  CHECK(found->at[1] == Approx(1).margin(0.01));
  CHECK(found->evaluations <= 4 * 40);
}

TEST_CASE("Values are rounded to a tenth of their interval") {
  CHECK(round_to_interval(3.14159, 3, 4) == Approx(3.1));
  CHECK(round_to_interval(1234, 1000, 2000) == 1200);
  CHECK(round_to_interval(0.0123456, 0.012, 0.0145) == Approx(0.0123));
  CHECK(round_to_interval(5.5, 5, 5) == 5.5);
  CHECK(round_to_interval(0.3456, 0, 20) == Approx(0.35));  // not 0
}

TEST_CASE("Strokes of known parameters give them back, and what is off is not seen") {
  const Recorded recorded = record(2, 2);
  const auto result = calibrate(recorded.view, std::nullopt, table(), small_options());
  if (!has_nlopt()) {
    REQUIRE_FALSE(result);
    CHECK(result.error().code == Errc::unsupported);
    return;
  }
  REQUIRE(result);
  CHECK(result->cost_after <= result->cost_before);
  const CalibratedParameter& height = parameter(*result, "height_um");
  CHECK(height.standing != Standing::not_seen);
  CHECK(height.low <= recorded.height_um);
  CHECK(height.high >= recorded.height_um);
  const CalibratedParameter& common = parameter(*result, "common_mode");
  CHECK((common.standing == Standing::not_seen || common.low == 0));
  CHECK(parameter(*result, "cover_um").standing == Standing::estimated);
  CHECK_FALSE(result->held_out.is_checked());
  CHECK_FALSE(result->held_out.passes());
}

TEST_CASE("One stroke is answered with what it shows") {
  if (!has_nlopt()) return;
  const Recorded recorded = record(1, 1);
  CalibrationOptions options = small_options();
  options.threads = 1;
  const auto one = calibrate(recorded.view, recorded.view, table(), options);
  REQUIRE(one);
  CHECK(parameter(*one, "path_mm").standing == Standing::not_seen);
  CHECK(parameter(*one, "tilt_mrad").standing == Standing::not_seen);
  CHECK(parameter(*one, "pad_ratio").value == parameter(*one, "pad_ratio").parameter.start);
  CHECK(one->held_out.is_checked());
  options.threads = 2;
  const auto two = calibrate(recorded.view, recorded.view, table(), options);
  REQUIRE(two);
  for (std::size_t i = 0; i < one->parameters.size(); ++i) {
    CHECK(one->parameters[i].value == two->parameters[i].value);
    CHECK(one->parameters[i].high == two->parameters[i].high);
  }
}

TEST_CASE("A cloth that is held out alone is refused") {
  if (!has_nlopt()) return;
  const auto result =
      calibrate(empty_strokes({"denim"}, 1), empty_strokes({"felt"}, 1), table(), small_options());
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::invalid_argument);
}

}  // namespace weft::daemon::calibration::fit_test
