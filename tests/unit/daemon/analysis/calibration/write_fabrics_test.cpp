// The written table is one that the simulation reads.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/analysis/calibration/calibration_page.hpp"
#include "daemon/analysis/calibration/write_fabrics.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::write_fabrics_test {

using namespace test;

namespace {

/// Each block with another standing.
CalibrationResult result_of(const ClothModel& model) {
  CalibrationResult out;
  out.cloths = model.cloths();
  for (const Parameter& p : model.parameters()) {
    const Standing standing = p.block == Block::cloth       ? Standing::calibrated
                              : p.block == Block::common    ? Standing::bounded
                              : p.block == Block::estimator ? Standing::not_seen
                                                            : Standing::estimated;
    out.parameters.push_back({p, standing, p.start, 0.9 * p.start, 1.1 * p.start});
  }
  return out;
}

}  // namespace

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

TEST_CASE("The calibrated table is read back with the values of the result") {
  const sim::FabricLibrary before = table();
  const auto model = ClothModel::make(empty_strokes({"DenimFlex", "Sofa"}, 1), before);
  REQUIRE(model);
  CalibrationResult result = result_of(*model);
  result.scale = 2;
  CalibrationSource source;
  source.prefix = "Own";
  const auto written = calibrated_table(table_text(), result, source);
  REQUIRE(written);
  CHECK((*written)["format"] == "weft-fabrics-2");
  const auto library = sim::parse_fabrics(written->dump());
  REQUIRE(library);
  CHECK(library->fabrics.size() == before.fabrics.size() + 2);
  const sim::Fabric* cloth = library->find("own.denimflex");
  REQUIRE(cloth != nullptr);
  const auto value = [&](std::string_view name, std::string_view of = {}) {
    return model->start()[model->find(name, of)];
  };
  CHECK(cloth->height_rms_m == Approx(1e-6 * value("height_um", "DenimFlex")));
  CHECK(cloth->thickness_m == before.find("denim")->thickness_m);
  CHECK(line_share(cloth->structure) == Approx(value("line_share", "DenimFlex")));
  CHECK(library->params.cover.lambda_m == Approx(1e-6 * value("cover_um")));
  CHECK(library->spread.touch.path_m == Approx(1e-3 * value("path_mm")));
  CHECK(library->spread.mounting.pad_height_m == Approx(1e-6 * value("pad_height_um")));
  REQUIRE(library->pads);
  CHECK(library->pads->gain_spread == Approx(value("gain_spread")));
  CHECK(library->pads->noise_counts == Approx(value("noise_counts")));  // not seen: as it was
  CHECK(library->pads->drift_counts == Approx(value("drift_counts") / 2));

  const auto again = calibrated_table(written->dump(), result, source);
  REQUIRE(again);
  CHECK((*again)["calibrations"].size() == 2);
  const auto twice = sim::parse_fabrics(again->dump());
  REQUIRE(twice);
  CHECK(twice->fabrics.size() == library->fabrics.size());
}

TEST_CASE("Other text is no table to begin from") {
  const auto written = calibrated_table("[1, 2", {}, {});
  REQUIRE_FALSE(written);
  CHECK(written.error().code == Errc::parse);
}

TEST_CASE("The page says what is simulated, and escapes what it is given") {
  const auto model = ClothModel::make(empty_strokes({"<b>"}, 1), table());
  REQUIRE(model);
  CalibrationResult result = result_of(*model);
  CalibrationSource source;
  source.bench = BenchKind::real;
  const std::string page = calibration_html(result, source);
  CHECK(page.find(bench_text(BenchKind::simulated)) != std::string::npos);
  CHECK(page.find("<b>") == std::string::npos);
}

}  // namespace weft::daemon::calibration::write_fabrics_test
