// The page: pictures, SIMULATED marks, and no NaN.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "daemon/analysis/calibration/calibration_page.hpp"
#include "daemon/analysis/calibration/objective.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::calibration_page_test {

using namespace test;

namespace {

std::size_t count_of(std::string_view text, std::string_view wanted) {
  std::size_t out = 0;
  for (auto at = text.find(wanted); at != text.npos; at = text.find(wanted, at + 1)) ++out;
  return out;
}

/// The text of each element, up to its end.
std::vector<std::string> elements(const std::string& page, const std::string& name) {
  std::vector<std::string> out;
  for (auto at = page.find("<" + name); at != page.npos; at = page.find("<" + name, at + 1))
    out.push_back(page.substr(at, page.find("</" + name + ">", at) - at));
  return out;
}

/// Two mountings with two repetitions of each fabric, waves of other lengths and levels.
RecordingView waves(const std::vector<std::string>& cloths) {
  RecordingView out = empty_strokes(cloths, 2, 2);
  for (Stroke& stroke : out.strokes)
    for (std::size_t c = 0; c < stroke.counts.size(); ++c) {
      const auto channel = static_cast<double>(c);
      const double level =
          recorded_level + channel * stroke.mounting + stroke.repetition * std::fmod(channel, 3);
      for (std::size_t i = 0; i < stroke.counts[c].size(); ++i)
        stroke.counts[c][i] =
            level + 8 * std::sin(static_cast<double>(i) * (0.3 + 0.02 * channel) +
                                 static_cast<double>(stroke.cloth.size()) + stroke.repetition);
      stroke.level[c] = mean_of(stroke.counts[c]);
    }
  return out;
}

CalibrationResult shown_result(const ClothModel& model, const RecordingView& view) {
  CalibrationResult out = result_of(model);
  out.real = out.before = out.after = view;
  for (const Statistic& s : compute_statistics(view).statistics)
    out.statistics.push_back(
        {s, s.value - 0.1, s.value + 0.1, s.value, s.value + 1, is_fitted(s.name)});
  out.blind_directions = {"one & two"};
  return out;
}

CalibrationSource real_source() {
  CalibrationSource out;
  out.bench = BenchKind::real;
  return out;
}

}  // namespace

TEST_CASE("Every picture and table is stamped SIMULATED") {
  const RecordingView view = waves({"denim", "felt"});
  const auto model = ClothModel::make(view, table());
  REQUIRE(model);
  const std::string page = render(calibration_document(shown_result(*model, view), real_source()));
  const auto pictures = elements(page, "svg");
  // A spectrum for each fabric; modulation, correlation, repetitions, patterns.
  CHECK(pictures.size() == model->cloths().size() + 4);
  const std::string stamp(bench_text(BenchKind::simulated));
  for (const std::string& picture : pictures) {
    CHECK(picture.find(stamp) != picture.npos);
    for (const char* family : {"family-0", "family-1", "family-2"})
      CHECK(picture.find(family) != picture.npos);
  }
  const auto figures = elements(page, "figure");
  CHECK(figures.size() > pictures.size());
  for (const std::string& figure : figures) CHECK(figure.find(stamp) != figure.npos);
  CHECK(page.find(bench_text(BenchKind::real)) != page.npos);
}

TEST_CASE("No number of the page is NaN, whatever the result has") {
  const RecordingView view = waves({"denim"});
  const auto model = ClothModel::make(view, table());
  REQUIRE(model);
  CalibrationResult result = shown_result(*model, view);
  result.cost_before = std::numeric_limits<double>::quiet_NaN();
  result.parameters.front().high = std::numeric_limits<double>::infinity();
  for (ComparedStatistic& s : result.statistics) {
    s.before.reset();
    s.after = std::numeric_limits<double>::quiet_NaN();
  }
  const std::string page = render(calibration_document(result, real_source()));
  for (const char* text : {">nan", " nan", "-nan", "\"nan", "NaN", ">inf", " inf", "-inf"}) {
    CAPTURE(text);
    CHECK(page.find(text) == page.npos);
  }
}

TEST_CASE("A statistic that only the held-out strokes have is in the table of the check") {
  const RecordingView view = waves({"denim"});
  const auto model = ClothModel::make(view, table());
  REQUIRE(model);
  CalibrationResult result = shown_result(*model, view);
  const std::size_t outside =
      count_of(render(calibration_document(result, real_source())), "OUTSIDE");
  const auto add = [&](const std::string& name, double low, double high, bool is_inside) {
    result.held_out.statistics.push_back(
        {{name, {}, Scale::natural, 0.625, 0.625}, low, high, is_inside});
  };
  add("only_held_out", 0.25, 0.875, true);
  add("without_band", 0.625, 0.625, false);
  result.held_out.inside = 1;
  const std::string page = render(calibration_document(result, real_source()));
  CHECK(count_of(page, "only_held_out") == 1);
  CHECK(count_of(page, "0.25 to 0.875") == 1);
  CHECK(count_of(page, "0.625 to 0.625") == 0);
  CHECK(count_of(page, "OUTSIDE") == outside + 1);
}

TEST_CASE("Each parameter is shown with its standing in words") {
  const auto model = ClothModel::make(empty_strokes({"denim"}, 1), table());
  REQUIRE(model);
  const std::string page = render(calibration_document(result_of(*model), real_source()));
  CHECK(count_of(page, "<td>calibrated</td>") == model->block(Block::cloth).size());
  CHECK(count_of(page, "<td>bounded</td>") == model->block(Block::common).size());
  CHECK(count_of(page, "<td>not determined</td>") == model->block(Block::estimator).size());
  CHECK(count_of(page, "<td>estimated</td>") == model->block(Block::fixed).size());
  CHECK(count_of(page, "not_seen") == 0);
}

TEST_CASE("An interval without width is not shown as one") {
  const RecordingView view = waves({"denim"});
  const auto model = ClothModel::make(view, table());
  REQUIRE(model);
  CalibrationResult result = shown_result(*model, view);
  result.parameters.resize(1);
  result.parameters[0].value = result.parameters[0].low = result.parameters[0].high = 0.4375;
  result.statistics.resize(1);
  result.statistics[0].low = result.statistics[0].high = result.statistics[0].real.value;
  const std::string page = render(calibration_document(result, real_source()));
  CHECK(count_of(page, "0.4375") == 1);
  CHECK(count_of(page, "interval-text\">") == 0);
  CHECK(count_of(page, "OUTSIDE") == 0);
}

TEST_CASE("Without strokes there is a page without pictures, and text is escaped") {
  const auto model = ClothModel::make(empty_strokes({"<b>"}, 1), table());
  REQUIRE(model);
  CalibrationResult result = result_of(*model);
  result.remarks = {"<b> & more"};
  const std::string page = render(calibration_document(result, real_source()));
  CHECK(count_of(page, "<svg") == 0);
  CHECK(count_of(page, "<b>") == 0);
  CHECK(count_of(page, "<li>&lt;b&gt; &amp; more</li>") == 1);
}

}  // namespace weft::daemon::calibration::calibration_page_test
