// Drawing and number formats: the markup is well formed and never has "nan".

#include <limits>

#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/confusion.hpp"
#include "daemon/pages/plot/svg.hpp"
#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace report_svg_test {

using namespace weft::daemon;

namespace {
constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();
}  // namespace

TEST_CASE("text is escaped, and bytes that are not UTF-8 are replaced") {
  CHECK(escape("a<b & \"c\" 'd'>") == "a&lt;b &amp; &quot;c&quot; &#39;d&#39;&gt;");
  CHECK(escape("\u00B1 \u00D7") == "\u00B1 \u00D7");
  CHECK(escape("x\x80y") == "x\uFFFDy");
  CHECK(escape("\xC0\xAF") == "\uFFFD\uFFFD");                      // overlong slash
  CHECK(escape("\xED\xA0\x80").find('\xED') == std::string::npos);  // surrogate
  CHECK(escape("cut \xE2\x82") == "cut \uFFFD\uFFFD");
  CHECK(escape(std::string("a\0b\x1B[0m", 7)) == "a\uFFFDb\uFFFD[0m");
}

TEST_CASE("numbers are written for readers") {
  CHECK(fixed(-0.0004, 2) == "0.00");
  CHECK(fixed(nan_value, 2) == no_value);
  CHECK(fixed(-infinite, 0) == no_value);
  CHECK(coordinate(12.50) == "12.5");
  CHECK(coordinate(-0.001) == "0");
  CHECK(coordinate(100) == "100");
  CHECK(coordinate(nan_value) == "0");
  CHECK(thousands(1234567) == "1,234,567");
  CHECK(thousands(999) == "999");
}

TEST_CASE("a percentage never shows 100 for a share below 1") {
  CHECK(percent(1.0) == "100.0");
  CHECK(percent(0.9999) == "99.9");
  CHECK(percent(0.9887, 2) == "98.87");
  CHECK(percent(nan_value) == no_value);
}

TEST_CASE("durations choose their unit") {
  CHECK(duration(17e-6) == "17.0 \u00B5s");
  CHECK(duration(0.017) == "17.0 ms");
  CHECK(duration(0.566) == "0.57 s");
  CHECK(duration(250) == "4 min 10 s");
  CHECK(duration(3599.9) == "1 h");
  CHECK(duration(7 * 3600 + 120) == "7 h 2 min");
  CHECK(duration(-1) == no_value);
}

TEST_CASE("a p-value that underflows a double is still written from its logarithm") {
  CHECK(p_value_html(-1000 * std::log(10.0) + std::log(2.0))
            .find("2.0&#8239;&#215;&#8239;10<sup>&#8722;1000<") == 0);
  CHECK(p_value_html(std::log(9.99e-5)).find("1.0&#8239;&#215;&#8239;10<sup>&#8722;4<") == 0);
  CHECK(p_value_html(std::log(0.03)) == "0.0300");
  CHECK(p_value_html(-infinite) == no_value);
  CHECK(p_value_html(std::log(1.2e-9)).find("<sup>&#8722;9</sup>") != std::string::npos);
}

TEST_CASE("grid values are written as they were meant") {
  CHECK(power_of_two_html(0x1p-11) == "2<sup>&#8722;11</sup>");
  CHECK(power_of_two_html(2) == "2<sup>1</sup>");
  CHECK(power_of_two_html(0.3) == "0.3");
  CHECK(power_of_two_html(0) == "0");
  CHECK(general(1e-5) == "1e-05");
  CHECK(general(infinite) == no_value);
  CHECK(significant(1013.4) == "1013");
  CHECK(significant(12.14) == "12.1");
  CHECK(significant(0.04561) == "0.0456");
  CHECK(significant(0) == "0");
  CHECK(significant(nan_value) == no_value);
}

TEST_CASE("ticks are round, inside the range and told apart by their decimals") {
  const svg::Ticks t = svg::ticks({0.1, 0.52}, 5);
  REQUIRE(t.at.size() == 5);
  CHECK(t.at.front() == Approx(0.1));
  CHECK(t.at.back() == Approx(0.5));
  CHECK(t.decimals == 1);
  CHECK(svg::ticks({0, 1000}, 4).decimals == 0);
  CHECK(svg::ticks({1, 1}, 5).at.empty());
  CHECK(svg::ticks({0, infinite}, 5).at.empty());
}

TEST_CASE("a range leaves out what is not finite and is never empty") {
  const std::vector<double> values = {2, nan_value, 4, infinite};
  const svg::Range r = svg::find_range(values, 0.5);
  CHECK(r.low == 1);
  CHECK(r.high == 5);
  const std::vector<double> flat = {3, 3};
  CHECK(svg::find_range(flat).high > svg::find_range(flat).low);
  CHECK(svg::find_range({}).high > svg::find_range({}).low);
}

TEST_CASE("a scale maps the ends of its range to its ends, upside down too") {
  const svg::Scale y{{10, 20}, 300, 100};
  CHECK(y(10) == 300);
  CHECK(y(20) == 100);
  CHECK(y(15) == 200);
}

TEST_CASE("a drawing of hostile values is well formed and without nan") {
  svg::Canvas canvas(100, 50, "<script>\"&", "a\"b");
  const std::vector<svg::Point> points = {{0, 0}, {1, nan_value}, {2, 2}, {infinite, 3}, {4, 4}};
  canvas.polyline(points, "curve");
  canvas.rect({nan_value, 0, -5, infinite}, "x", nan_value);
  canvas.line({0, 0}, {nan_value, 1}, "x");
  canvas.circle({infinite, 1}, 2, "x");
  canvas.text({1, 1}, "a < b", "x", svg::Anchor::middle, true);
  const std::string out = canvas.finish();
  CHECK(report_test::unbalanced(out).empty());
  CHECK(out.find("nan") == std::string::npos);
  CHECK(out.find("inf") == std::string::npos);
  CHECK(out.find("<script>") == std::string::npos);
  CHECK(out.find("M0 0M2 2M4 4") != std::string::npos);  // gaps, not bridges
}

TEST_CASE("thinning keeps the peaks, and a pause breaks the line") {
  Curve curve;
  for (int i = 0; i < 10000; ++i) {
    curve.t_s.push_back(i * 0.01 + (i >= 5000 ? 2.0 : 0.0));
    curve.value.push_back(i == 1234 ? 99 : i == 7777 ? -99 : 0);
  }
  const std::vector<TracePoint> points = thinned(curve, 100);
  CHECK(points.size() < 220);
  double most = 0, least = 0;
  std::size_t gaps = 0;
  for (const TracePoint& p : points) {
    gaps += std::isnan(p.x) ? 1 : 0;
    most = std::max(most, p.y);
    least = std::min(least, p.y);
  }
  CHECK(most == 99);
  CHECK(least == -99);
  CHECK(gaps == 1);
  CHECK(thinned({}, 10).empty());
}

TEST_CASE("a confusion map shows every count and names every fabric, and words name the worst") {
  weft::classifier::Confusion confusion({"felt", "silk", "<wool>"});
  confusion.at(0, 0) = 40;
  confusion.at(1, 1) = 37;
  confusion.at(1, 0) = 3;
  confusion.at(2, 2) = 41;
  const std::string map = chart::draw(confusion_cells(confusion, "test", {0, 1, 2}));
  CHECK(report_test::unbalanced(map).empty());
  for (const char* text : {">40<", ">37<", ">3<", ">41<", ">100 %<", ">felt<", ">&lt;wool&gt;<"})
    CHECK(map.find(text) != std::string::npos);
  CHECK(report_test::count_of(map, "\"cell-miss\"") == 1);
  CHECK(report_test::count_of(map, "\"cell-hit\"") == 3);
  CHECK(worst_confusions(confusion, 3) ==
        "Most frequent errors: silk predicted as felt 3 times (7.5 %).");
  CHECK(worst_confusions(weft::classifier::Confusion({"a", "b"}), 3) == "No wrong predictions.");
}

TEST_CASE("a feature's name is set as the paper writes it") {
  CHECK(feature_html("range.M.4") ==
        "<span class=\"feature\"><i>F</i><sup>M</sup><sub>range.4</sub></span>");
  CHECK(feature_html("mean.P") ==
        "<span class=\"feature\"><i>F</i><sup>P</sup><sub>mean</sub></span>");
  CHECK(feature_html("<x>") == "&lt;x&gt;");
}

}  // namespace report_svg_test
