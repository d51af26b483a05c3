// The simulation can read the written table.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/analysis/calibration/write_fabrics.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::write_fabrics_test {

using namespace test;

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
  const std::string text = table_text(*written);
  CHECK(nlohmann::ordered_json::parse(text) == *written);
  const auto library = sim::parse_fabrics(text);
  REQUIRE(library);
  CHECK(library->fabrics.size() == before.fabrics.size() + 2);
  const sim::Fabric* cloth = library->find("own.denimflex");
  REQUIRE(cloth != nullptr);
  const auto value = [&](std::string_view name, std::string_view of = {}) {
    return model->start()[model->find(name, of)];
  };
  CHECK(cloth->height_rms_m == Approx(1e-6 * value("height_um", "DenimFlex")).epsilon(1e-3));
  CHECK(cloth->waviness_rms_m == Approx(1e-6 * value("waviness_um", "DenimFlex")));
  CHECK(cloth->thickness_m == before.find("denim")->thickness_m);
  CHECK(line_share(cloth->structure) == Approx(value("line_share", "DenimFlex")));
  CHECK(library->params.cover.lambda_m == Approx(1e-6 * value("cover_um")));
  CHECK(library->spread.touch.path_m == Approx(1e-3 * value("path_mm")));
  CHECK(library->spread.mounting.pad_height_m == Approx(1e-6 * value("pad_height_um")));
  REQUIRE(library->pads);
  CHECK(library->pads->gain_spread == Approx(value("gain_spread")));
  CHECK(library->pads->noise_counts == Approx(value("noise_counts")));  // seen by an earlier
                                                                        // calibration
  CHECK(library->pads->drift_counts == Approx(value("drift_counts") / 2));

  const auto again = calibrated_table(written->dump(), result, source);
  REQUIRE(again);
  CHECK((*again)["calibrations"].size() == (*written)["calibrations"].size() + 1);
  CHECK((*again)["calibrations"].contains(next_calibration(*written)));
  const auto twice = sim::parse_fabrics(again->dump());
  REQUIRE(twice);
  CHECK(twice->fabrics.size() == library->fabrics.size());
}

TEST_CASE("A table is laid out in lines that can be read, whatever its strings have") {
  const nlohmann::ordered_json table = {{"name", "\"a\": [1, 2], {}"},
                                        {"empty", nlohmann::ordered_json::object()},
                                        {"long", std::vector<double>(60, 0.25)},
                                        {"short", {1, "estimated"}}};
  const std::string text = table_text(table);
  CHECK(nlohmann::ordered_json::parse(text) == table);
  CHECK(text.find("\n  \"short\": [1, \"estimated\"]\n") != std::string::npos);
  CHECK(std::ranges::count(text, '\n') == 1 + 4 + 60 + 2);  // braces, keys, numbers, a bracket
}

TEST_CASE("Other text is no table to begin from") {
  const auto written = calibrated_table("[1, 2", {}, {});
  REQUIRE_FALSE(written);
  CHECK(written.error().code == Errc::parse);
}

}  // namespace weft::daemon::calibration::write_fabrics_test
