// A calibration on strokes simulated with known parameters. The "recorded" strokes are SIMULATED
// too.

#include <catch2/catch.hpp>
#include <cmath>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/analysis/calibration/minimise.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::fit_test {

using namespace test;

namespace {

constexpr std::uint64_t recorded_seed = 99;  // seed of another piece than the fit simulates

CalibrationOptions small_options() {
  CalibrationOptions out;
  out.windows = 6;
  out.starts = 1;
  out.evaluations = 12;
  out.common_evaluations = 20;
  out.rounds = 1;
  out.bootstrap_draws = 50;
  out.replicates = 6;
  out.held_out_replicates = 4;
  return out;
}

/// Strokes of fabrics with half of the estimated height, and without common mode.
struct Recorded {
  RecordingView view;
  ClothModel model;
  std::vector<double> values;

  [[nodiscard]] double value(std::string_view name, std::string_view cloth = {}) const {
    return values[model.find(name, cloth)];
  }
};

Recorded record(const RecordingView& like) {
  auto model = ClothModel::make(like, table());
  REQUIRE(model);
  std::vector<double> values = model->start();
  for (const BaseCloth& cloth : model->cloths())
    values[model->find("height_um", cloth.label)] *= 0.5;
  values[model->find("common_mode")] = 1e-5;
  auto scene = Scene::make(like, *model);
  REQUIRE(scene);
  auto view = scene->simulate(values, recorded_seed, 1);
  REQUIRE(view);
  return {std::move(*view), std::move(*model), std::move(values)};
}

const CalibratedParameter& parameter(const CalibrationResult& result, std::string_view name) {
  for (const CalibratedParameter& p : result.parameters)
    if (p.parameter.name == name) return p;
  FAIL("no parameter " << name);
  return result.parameters.front();
}

void check_finite(const CalibrationResult& result) {
  for (const CalibratedParameter& p : result.parameters) {
    CAPTURE(p.parameter.label());
    CHECK(std::isfinite(p.value));
    CHECK(std::isfinite(p.low));
    CHECK(std::isfinite(p.high));
  }
  for (const ComparedStatistic& s : result.statistics) {
    CAPTURE(s.real.name);
    CHECK(std::isfinite(s.real.value));
    CHECK(std::isfinite(s.low + s.high + s.before.value_or(0) + s.after.value_or(0)));
  }
  CHECK(std::isfinite(result.cost_after));
}

}  // namespace

TEST_CASE("Values are rounded to a tenth of their interval") {
  CHECK(round_to_interval(3.14159, 3, 4) == Approx(3.1));
  CHECK(round_to_interval(1234, 1000, 2000) == 1200);
  CHECK(round_to_interval(0.0123456, 0.012, 0.0145) == Approx(0.0123));
  CHECK(round_to_interval(5.5, 5, 5) == 5.5);
  CHECK(round_to_interval(0.3456, 0, 20) == Approx(0.35));  // not 0
}

TEST_CASE("Strokes of known parameters give them back, and what is off is not seen") {
  const Recorded recorded = record(empty_strokes({"denim"}, 2, 2));
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
  CHECK(height.low <= recorded.value("height_um", "denim"));
  CHECK(height.high >= recorded.value("height_um", "denim"));
  const CalibratedParameter& common = parameter(*result, "common_mode");
  CHECK((common.standing == Standing::not_seen || common.low == 0));
  CHECK(parameter(*result, "cover_um").standing == Standing::estimated);
  CHECK_FALSE(result->held_out.is_checked());
  CHECK_FALSE(result->held_out.passes());
}

TEST_CASE("Most intervals of two cloths hold the value that was simulated") {
  if (lacks_nlopt()) return;
  const Recorded recorded = record(empty_strokes({"denim", "felt"}, 1, 2));
  const auto result = calibrate(recorded.view, std::nullopt, table(), small_options());
  REQUIRE(result);
  check_finite(*result);
  std::size_t identified = 0, inside = 0;
  for (const CalibratedParameter& p : result->parameters) {
    const bool is_searched =
        p.parameter.block == Block::cloth || p.parameter.block == Block::common;
    if (!is_searched || p.standing != Standing::calibrated) continue;
    const double known = recorded.value(p.parameter.name, p.parameter.cloth);
    ++identified;
    inside += p.low <= known && known <= p.high ? 1 : 0;
  }
  CAPTURE(identified, inside);
  CHECK(identified > 0);
  CHECK(2 * inside > identified);
}

TEST_CASE("One channel shows no pattern, and every number is finite") {
  if (lacks_nlopt()) return;
  const Recorded recorded = record(empty_strokes({"denim"}, 1, 2, 1));
  const auto result = calibrate(recorded.view, std::nullopt, table(), small_options());
  REQUIRE(result);
  check_finite(*result);
  CHECK_FALSE(result->remarks.empty());
  for (const char* name : {"pad_ratio", "gain_spread", "common_mode"}) {
    CAPTURE(name);
    CHECK(parameter(*result, name).standing == Standing::not_seen);
    CHECK(parameter(*result, name).value == parameter(*result, name).parameter.start);
  }
}

TEST_CASE("One stroke is answered with what it shows") {
  if (lacks_nlopt()) return;
  const Recorded recorded = record(empty_strokes({"denim"}, 1));
  CalibrationOptions options = small_options();
  options.threads = 1;
  const auto one = calibrate(recorded.view, recorded.view, table(), options);
  REQUIRE(one);
  CHECK(parameter(*one, "path_mm").standing == Standing::not_seen);
  CHECK(parameter(*one, "tilt_mrad").standing == Standing::not_seen);
  CHECK(parameter(*one, "pad_ratio").value == parameter(*one, "pad_ratio").parameter.start);
  CHECK(one->held_out.is_checked());
  CHECK_FALSE(one->remarks.empty());
  check_finite(*one);
  for (const CalibratedParameter& p : one->parameters) {
    CAPTURE(p.parameter.label());
    CHECK(p.has_interval() == (p.standing != Standing::estimated));
  }
  CHECK(parameter(*one, "noise_counts").standing != Standing::calibrated);
  options.threads = 2;
  const auto two = calibrate(recorded.view, recorded.view, table(), options);
  REQUIRE(two);
  for (std::size_t i = 0; i < one->parameters.size(); ++i) {
    CHECK(one->parameters[i].value == two->parameters[i].value);
    CHECK(one->parameters[i].high == two->parameters[i].high);
  }
}

TEST_CASE("Labels that differ in case alone are refused before the fit") {
  if (lacks_nlopt()) return;
  const auto result =
      calibrate(empty_strokes({"Denim", "denim"}, 1), std::nullopt, table(), small_options());
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::invalid_argument);
}

TEST_CASE("Recordings without a level are refused with it and what helps") {
  if (lacks_nlopt()) return;
  std::vector<std::string> hints;
  for (const double level : {0.5, -300.0}) {
    RecordingView view = empty_strokes({"denim"}, 1);
    view.strokes[0].level.assign(view.channels, level);
    for (std::vector<double>& counts : view.strokes[0].counts) counts.assign(92, level);
    const auto result = calibrate(view, std::nullopt, table(), small_options());
    REQUIRE_FALSE(result);
    CHECK(result.error().code == Errc::measurement);
    CHECK(std::stod(result.error().got) == level);
    hints.push_back(result.error().hint);
  }
  CHECK_FALSE(hints[0].empty());
  CHECK_FALSE(hints[1].empty());
  CHECK(hints[0] != hints[1]);
}

TEST_CASE("More cloths than windows are refused") {
  if (lacks_nlopt()) return;
  CalibrationOptions options = small_options();
  options.windows = 1;
  const auto result =
      calibrate(empty_strokes({"denim", "felt"}, 1), std::nullopt, table(), options);
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::invalid_argument);
  CHECK(result.error().got == "2");
}

TEST_CASE("A cloth that is held out alone is refused") {
  if (lacks_nlopt()) return;
  const auto result =
      calibrate(empty_strokes({"denim"}, 1), empty_strokes({"felt"}, 1), table(), small_options());
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::invalid_argument);
  CHECK(result.error().got == "felt");
}

TEST_CASE("Held-out strokes of another number of channels are refused") {
  if (lacks_nlopt()) return;
  const auto result = calibrate(empty_strokes({"denim"}, 1), empty_strokes({"denim"}, 1, 1, 9),
                                table(), small_options());
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::invalid_argument);
  CHECK(result.error().got == "9");
}

TEST_CASE("A fabric with all strokes off the fabric is neither fitted nor checked") {
  if (lacks_nlopt()) return;
  const Recorded recorded = record(empty_strokes({"denim", "felt"}, 1));
  RecordingView lifted = recorded.view;
  lifted.strokes[1].level.assign(lifted.channels, 0);
  for (std::vector<double>& counts : lifted.strokes[1].counts) counts.assign(counts.size(), 0);
  const auto result = calibrate(lifted, recorded.view, table(), small_options());
  REQUIRE(result);
  CHECK(result->cloths.size() == 1);
  CHECK(result->held_out.is_checked());
  CHECK(result->held_out_strokes == 1);
  lifted.strokes[0] = lifted.strokes[1];
  lifted.strokes[0].cloth = "denim";
  const auto unchecked = calibrate(recorded.view, lifted, table(), small_options());
  REQUIRE(unchecked);
  CHECK_FALSE(unchecked->held_out.is_checked());
  CHECK_FALSE(unchecked->held_out.why_not.empty());
}

}  // namespace weft::daemon::calibration::fit_test
