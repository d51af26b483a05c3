// Parameters, their bounds, and the initial fabric of a label.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/cloth_model.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::cloth_model_test {

using namespace test;

TEST_CASE("Reshaping keeps the variance of a surface") {
  const sim::Structure before = table().find("denim")->structure;
  const sim::Structure after = reshaped(before, 0.3, 200);
  CHECK(line_share(after) == Approx(0.3));
  CHECK(line_share(after) + after.isotropic_share + after.streak_share == Approx(1));
  CHECK(after.isotropic_share / after.streak_share ==
        Approx(before.isotropic_share / before.streak_share));
  CHECK(after.low_per_m == 200);
}

TEST_CASE("A parameter keeps to its bounds on its own scale") {
  Parameter p;
  p.low = 0.01;
  p.logarithmic = true;
  CHECK(p.to_unit(0.1) == Approx(0.5));
  CHECK(p.from_unit(p.to_unit(0.37)) == Approx(0.37));
  CHECK(p.from_unit(-1) == Approx(0.01));
  CHECK(p.to_unit(7) == Approx(1));
}

TEST_CASE("A label takes the cloth that it names, another the one of median stiffness") {
  const auto model = ClothModel::make(empty_strokes({"BrownCotton", "Sofa"}, 1), table());
  REQUIRE(model);
  REQUIRE(model->cloths().size() == 2);
  CHECK(model->cloths()[0].taken == "cotton");
  CHECK(model->cloths()[0].is_named);
  CHECK_FALSE(model->cloths()[1].is_named);
  const auto none = ClothModel::make(empty_strokes({"denim"}, 1), {});
  REQUIRE_FALSE(none);
  CHECK(none.error().code == Errc::not_found);
}

TEST_CASE("Every parameter begins within its bounds, which have a reason") {
  const auto model = ClothModel::make(empty_strokes({"denim", "Sofa"}, 1), table());
  REQUIRE(model);
  for (const Parameter& p : model->parameters()) {
    CAPTURE(p.label());
    CHECK(p.low < p.high);
    CHECK(p.start >= p.low);
    CHECK(p.start <= p.high);
    CHECK_FALSE(p.reason.empty());
    if (p.logarithmic) CHECK(p.low > 0);
  }
}

TEST_CASE("A value reaches the plant of its own cloth, in SI units") {
  const auto model = ClothModel::make(empty_strokes({"denim", "felt"}, 1), table());
  REQUIRE(model);
  std::vector<double> values = model->start();
  values[model->find("height_um", "felt")] = 7;
  values[model->find("path_mm")] = 0.5;
  values[model->find("tilt_mrad")] = 3;
  const ClothModel::Inputs felt = model->inputs("felt", values),
                           denim = model->inputs("denim", values);
  CHECK(felt.fabric.height_rms_m == Approx(7e-6));
  CHECK(denim.fabric.height_rms_m ==
        Approx(1e-6 * model->start()[model->find("height_um", "denim")]));
  CHECK(felt.spread.touch.path_m == Approx(5e-4));
  CHECK(denim.spread.mounting.tilt == Approx(3e-3));
}

TEST_CASE("A block has its own parameters, and an unknown name has no number") {
  const auto model = ClothModel::make(empty_strokes({"denim", "felt"}, 1), table());
  REQUIRE(model);
  const auto felt = model->block(Block::cloth, "felt");
  CHECK_FALSE(felt.empty());
  for (const std::size_t i : felt) CHECK(model->parameters()[i].cloth == "felt");
  for (const std::size_t i : model->block(Block::common))
    CHECK(model->parameters()[i].cloth.empty());
  CHECK(model->find("height_um", "silk") == model->parameters().size());
}

TEST_CASE("Counts are those of the recorded sensor in values and bounds, the plant's in inputs") {
  const RecordingView view = empty_strokes({"denim"}, 1);
  const auto same = ClothModel::make(view, table()), louder = ClothModel::make(view, table(), 5);
  REQUIRE(same);
  REQUIRE(louder);
  CHECK(same->scale() == 1);
  for (std::size_t i = 0; i < same->parameters().size(); ++i) {
    const Parameter &p = same->parameters()[i], &q = louder->parameters()[i];
    CAPTURE(p.name);
    const bool is_in_counts =
        p.name == "noise_counts" || p.name == "noise_per_count" || p.name == "drift_counts";
    CHECK(q.start == Approx(p.start * (is_in_counts ? 5 : 1)));
    CHECK(q.high == Approx(p.high * (is_in_counts ? 5 : 1)));
  }
  const sim::PadParams pads = louder->inputs("denim", louder->start()).pads;
  CHECK(pads.noise_counts == Approx(same->inputs("denim", same->start()).pads.noise_counts));
  CHECK(pads.drift_counts == Approx(same->inputs("denim", same->start()).pads.drift_counts));
}

}  // namespace weft::daemon::calibration::cloth_model_test
