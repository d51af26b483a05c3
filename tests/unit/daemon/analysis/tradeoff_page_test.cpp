// The Pareto front, its picture, its page and its JSON.

#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/chart.hpp"
#include "daemon/pages/plot/svg.hpp"
#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace trade_page_test {

using namespace weft;
using namespace weft::daemon;
using report_test::count_of;
using report_test::unbalanced;

namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();
using Indices = std::vector<std::size_t>;

Indices front(const std::vector<TradeoffChoice>& choices) {
  const auto out = pareto_front(choices);
  REQUIRE(out.has_value());
  return *out;
}

// The definition, literally.
bool dominated(const std::vector<TradeoffChoice>& all, const TradeoffChoice& one) {
  return std::any_of(all.begin(), all.end(), [&](const TradeoffChoice& other) {
    return other.gain >= one.gain && other.cost <= one.cost &&
           (other.gain > one.gain || other.cost < one.cost);
  });
}

TradeoffPoint point(const std::string& name, const std::string& family, double accuracy,
                    double answer_s, double contact_s) {
  TradeoffPoint out;
  out.name = name;
  out.family = family;
  out.settings = {{"learner", std::string("pvalue")}, {"N", 20.0}};
  out.bench = BenchKind::simulated;
  out.accuracy = accuracy;
  out.ci95 = {accuracy - 0.05, std::min(1.0, accuracy + 0.05), "made up"};
  out.tested = 200;
  out.timings_s = {answer_s, answer_s * 1.1, answer_s / 3, answer_s / 7, answer_s * 2};
  out.answer_s = answer_s;
  out.contact_s = contact_s;
  out.train_s = 0.1;
  return out;
}

const std::vector<TradeoffCost> costs = {
    {"answer_s", "time", "compute time", &TradeoffPoint::answer_s},
    {"contact_s", "sliding", "contact", &TradeoffPoint::contact_s}};

// Front by time: fast, default. Front by sliding: fast, default and its equal. On no front: slow.
TradeoffReport made_up() {
  TradeoffSet set;
  set.dataset = "out/<demo> & more.h5";
  set.sha256 = "abc";
  set.bench = BenchKind::simulated;
  set.facts = {{"trials", 40.0}, {"split", std::string("groups 1 train")}};
  set.left_out = {{"speed", "speeds not recorded"}};
  set.points = {point("default", "default", 0.9, 2e-4, 25), point("fast", "slide", 0.6, 3e-5, 1),
                point("slow", "learner", 0.8, 4e-4, 25), point("equal", "vote", 0.9, 3e-4, 25)};
  TradeoffReport out;
  out.title = "Accuracy against time";
  out.command = "trade test";
  out.costs = costs;
  out.sets = {set};
  out.machine = "test machine";
  return out;
}

std::string page_of(const TradeoffReport& report) {
  const auto page = tradeoff_document(report);
  REQUIRE(page.has_value());
  return render(*page);
}

// The style sheet and text may contain "information"; figures must not contain these words.
void check_figures(const std::string& markup) {
  for (const char* word : {"\"nan", ">nan", " nan", "\"inf\"", ">inf<", "-nan", "\"-inf"})
    CHECK(markup.find(word) == std::string::npos);
}

}  // namespace

TEST_CASE("a choice with less gain at the same or higher cost is not on the front") {
  CHECK(front({{0.9, 2}, {0.8, 3}, {0.5, 1}}) == Indices{2, 0});
  CHECK(front({{0.5, 1}, {0.9, 1}}) == Indices{1});  // equal cost: more gain
  CHECK(front({{0.9, 2}, {0.9, 1}}) == Indices{1});  // equal gain: less cost
}

TEST_CASE("choices equal in both are on the front together or not at all") {
  CHECK(front({{0.9, 1}, {0.9, 1}, {0.5, 3}, {0.5, 3}}) == Indices{0, 1});
}

TEST_CASE("a single choice is the front, and nothing has an empty one") {
  CHECK(front({{0.1, 5}}) == Indices{0});
  CHECK(front({}).empty());
}

TEST_CASE("a gain or cost that is not finite is refused by its index") {
  for (const double bad : {nan_value, infinite, -infinite}) {
    const std::vector<TradeoffChoice> gains = {{0.5, 1}, {bad, 2}},
                                      costs_of = {{0.5, 1}, {0.5, bad}};
    for (const auto& choices : {gains, costs_of}) {
      const auto out = pareto_front(choices);
      REQUIRE_FALSE(out.has_value());
      CHECK(out.error().where == "choice 1");
    }
  }
}

TEST_CASE("the front follows the definition, ties included") {
  std::mt19937 engine(3);
  std::uniform_int_distribution<int> coarse(0, 6);  // many ties
  for (int round = 0; round < 300; ++round) {
    std::vector<TradeoffChoice> all(static_cast<std::size_t>(1 + round % 20));
    for (TradeoffChoice& one : all) one = {coarse(engine) / 8.0, coarse(engine) / 4.0};
    const Indices on = front(all);
    for (std::size_t i = 0; i < all.size(); ++i)
      CHECK((std::find(on.begin(), on.end(), i) != on.end()) == !dominated(all, all[i]));
    for (std::size_t k = 1; k < on.size(); ++k) CHECK(all[on[k - 1]].cost <= all[on[k]].cost);
  }
}

TEST_CASE("a logarithmic axis gives every decade the same room") {
  const svg::Scale x{{1e-3, 1}, 0, 300, true};
  CHECK(x(1e-3) == Approx(0).margin(1e-9));
  CHECK(x(1e-2) == Approx(100));
  CHECK(x(1) == Approx(300));
  CHECK_FALSE(std::isfinite(x(0)));
}

TEST_CASE("ticks of a logarithmic axis are 1, 2, 5 within it, or decades alone where it is long") {
  const auto few = svg::log_ticks({0.9, 21});
  REQUIRE(few.size() == 5);
  CHECK(few.front() == Approx(1));
  CHECK(few.back() == Approx(20));
  CHECK(svg::log_ticks({1e-6, 1}).size() == 7);
  CHECK(svg::log_ticks({0, 1}).empty());
  CHECK(svg::log_ticks({1, nan_value}).empty());
}

TEST_CASE("the range of a logarithmic axis holds the positive values and is never empty") {
  const std::vector<double> values = {0.1, nan_value, -4, 0, 10};
  const svg::Range range = svg::log_range_of(values);
  CHECK((range.low > 0 && range.low < 0.1));
  CHECK((range.high > 10 && range.high < 20));
  const std::vector<double> one = {5};
  CHECK(svg::log_range_of(one).low < svg::log_range_of(one).high);
  CHECK(svg::log_range_of({}).low > 0);
}

TEST_CASE("times on an axis are in the unit that makes them short") {
  CHECK(tick_text(2e-5) == "20 \u00B5s");
  CHECK(tick_text(1e-3) == "1 ms");
  CHECK(tick_text(0.05) == "50 ms");
  CHECK(tick_text(0.5) == "0.5 s");
  CHECK(tick_text(20) == "20 s");
}

TEST_CASE("the median is the middle one, or the mean of the middle two") {
  CHECK(compute_median({3, 1, 2}) == 2);
  CHECK(compute_median({4, 1, 2, 3}) == 2.5);
  CHECK(compute_median({}) == 0);
}

TEST_CASE(
    "points on a front have a diamond, are joined and named; the picture is marked SIMULATED") {
  const std::string page = page_of(made_up());
  const std::string svg = page.substr(page.find("<svg"), page.find("</svg>") - page.find("<svg"));
  // two on the front of each panel, and equal beside default in (b); one in the legend
  CHECK(count_of(svg, "class=\"front-mark\"") == 2 + 3 + 1);
  CHECK(count_of(svg, "class=\"front-line\"") == 2);
  CHECK(count_of(svg, ">fast</text>") == 2);
  CHECK(count_of(svg, ">equal</text>") == 1);
  CHECK(count_of(svg, ">slow</text>") == 0);
  CHECK(svg.find("class=\"stamp\" ") != std::string::npos);
  CHECK(svg.find(">SIMULATED</text>") != std::string::npos);
  check_figures(svg);
}

TEST_CASE("a point without a place on the axis is skipped, and no text is nan") {
  chart::Series series{"one"};
  for (const double time_s : {1.0, 0.0, -1.0, nan_value, infinite})
    series.points.push_back({time_s, 0.5, 0.4, 0.6, "p", true});
  chart::Plot plot{"words", "SIMULATED"};
  plot.panels = {{"(a)", {.title = "time", .logarithmic = true}, {.title = "share"}}};
  plot.panels.front().series = {series};
  const std::string svg = chart::draw(plot);
  CHECK(count_of(svg, ">p</text>") == 1);
  CHECK(unbalanced(svg).empty());
  check_figures(svg);
}

TEST_CASE("every picture and table of the page bears the word, rows on a front are marked") {
  const std::string page = page_of(made_up());
  const std::string body = page.substr(page.find("<body>"));
  CHECK(unbalanced(page.substr(page.find("<html"))).empty());
  CHECK(count_of(body, "<figcaption><span class=\"badge\">SIMULATED</span>") == 2);
  CHECK(count_of(body, "<tr class=\"on-front\">") == 3);
  CHECK(body.find("\u25C6 compute time, \u25C6 contact") != std::string::npos);
  CHECK(body.find("out/&lt;demo&gt; &amp; more.h5") != std::string::npos);
  CHECK(body.find("speeds not recorded") != std::string::npos);
}

TEST_CASE("the page needs nothing from elsewhere") {
  const std::string page = page_of(made_up());
  CHECK(page.find("<script") == std::string::npos);
  CHECK(page.find("<link") == std::string::npos);
  CHECK(page.find("url(") == std::string::npos);
  CHECK(count_of(page, "http") == count_of(page, "xmlns=\"http://www.w3.org/2000/svg\""));
}

TEST_CASE("real and simulated data have sections and badges of their own") {
  TradeoffReport report = made_up();
  report.sets.push_back(report.sets.front());
  report.sets.back().bench = BenchKind::real;
  report.sets.back().dataset = "cloth.h5";
  for (TradeoffPoint& p : report.sets.back().points) p.bench = BenchKind::real;
  const std::string page = page_of(report);
  CHECK(count_of(page, "<svg") == 2);
  CHECK(count_of(page, ">SIMULATED</text>") == 1);
  CHECK(count_of(page, ">REAL DATA</text>") == 1);
}

TEST_CASE("a point of another bench is refused, for one front would be over both") {
  TradeoffReport report = made_up();
  report.sets.front().points.back().bench = BenchKind::real;
  const auto page = tradeoff_document(report);
  REQUIRE_FALSE(page.has_value());
  CHECK(page.error().expected == "simulated");
  CHECK(page.error().got == "real");
  CHECK_FALSE(tradeoff_json(report).has_value());
}

TEST_CASE("figures that are no shares or no times are refused by the name of their point") {
  const auto refused = [](auto spoil) {
    TradeoffReport report = made_up();
    spoil(report.sets.front().points[1]);
    const auto data = tradeoff_json(report);
    REQUIRE_FALSE(data.has_value());
    CHECK(to_string(data.error()).find("fast") != std::string::npos);
    CHECK_FALSE(tradeoff_document(report).has_value());
  };
  refused([](TradeoffPoint& p) { p.accuracy = nan_value; });
  refused([](TradeoffPoint& p) { p.accuracy = 1.01; });
  refused([](TradeoffPoint& p) { p.ci95.high = infinite; });
  refused([](TradeoffPoint& p) { p.answer_s = 0; });
  refused([](TradeoffPoint& p) { p.contact_s = nan_value; });
  TradeoffReport empty = made_up();
  empty.sets.front().points.clear();
  CHECK_FALSE(tradeoff_json(empty).has_value());
}

TEST_CASE("the JSON comes back as it went in, with the fronts marked") {
  const TradeoffReport report = made_up();
  const auto data = tradeoff_json(report);
  REQUIRE(data.has_value());
  const auto read = nlohmann::json::parse(data->dump());
  CHECK(read["schema_version"] == 1);
  CHECK(read["command"] == "trade test");
  const auto& set = read["data_sets"][0];
  CHECK(set["bench"] == "simulated");
  CHECK(set["dataset_sha256"] == "abc");
  CHECK(set["facts"]["trials"].is_number_integer());
  CHECK(set["facts"]["trials"] == 40);
  CHECK(set["left_out"]["speed"] == "speeds not recorded");
  REQUIRE(set["points"].size() == report.sets[0].points.size());
  for (std::size_t i = 0; i < set["points"].size(); ++i) {
    const auto& got = set["points"][i];
    const TradeoffPoint& sent = report.sets[0].points[i];
    CHECK(got["name"] == sent.name);
    CHECK(got["timings_s"].get<std::vector<double>>() == sent.timings_s);
    CHECK(got["accuracy"].get<double>() == sent.accuracy);
    CHECK(got["ci95"][0].get<double>() == sent.ci95.low);
    CHECK(got["settings"]["N"] == 20.0);
    CHECK(got["settings"]["learner"] == "pvalue");
    CHECK(got["front"]["answer_s"] == (i < 2));
    CHECK(got["front"]["contact_s"] == (i != 2));
  }
  CHECK(set["fronts"]["answer_s"] == nlohmann::json({"fast", "default"}));
  CHECK(set["fronts"]["contact_s"] == nlohmann::json({"fast", "default", "equal"}));
}

}  // namespace trade_page_test
