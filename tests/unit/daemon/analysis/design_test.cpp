// Campaign design: results and statements of a sweep's analysis, and learning curves.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/design/design_page.hpp"
#include "tests/unit/daemon/analysis/swept_data.hpp"

namespace design_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test_sweep;

namespace {

/// All texts from `begin` to `end`.
std::vector<std::string> parts(const std::string& text, const std::string& begin,
                               const std::string& end) {
  std::vector<std::string> out;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1))
    out.push_back(text.substr(at, text.find(end, at) - at));
  return out;
}

}  // namespace

TEST_CASE("An analysis finds the force that tells fabrics apart, and takes the quick cell") {
  const SweepAnalysis a = analysed(swept(BenchKind::simulated));
  CHECK(a.exploration == "rub");
  CHECK(a.replicates == 4);
  REQUIRE(a.cells.size() == 4);
  CHECK(a.cells[3].factors == std::vector<double>{5, 0.004});
  CHECK(a.choice.chosen == 3);
  CHECK(a.choice.cells[3].figures.accuracy == 1);
  CHECK(a.choice.cells[0].figures.accuracy < 0.8);
  CHECK(a.choice.supported);
  // 20 mm at 1 and at 4 mm/s, three phases of a second
  CHECK(a.cells[2].seconds.value == Approx(23).epsilon(0.02));
  CHECK(a.cells[3].seconds.value == Approx(8).epsilon(0.02));
  // amplitudes of 60 and 100 counts: 4.4 dB
  CHECK(a.cells[2].snr_db.value - a.cells[0].snr_db.value == Approx(4.4).margin(0.5));
  CHECK(a.cells[0].saturated_share.value == 0);
  CHECK(a.choice.front == std::vector<std::size_t>{3});
  REQUIRE(a.surest.size() == 2);
  CHECK(a.surest[0].value == 5);
  CHECK_THAT(recommendation(a), Catch::Contains(": 5 N, 4 mm/s: 100.0 %"));
}

TEST_CASE("Without differences the analysis reports that the data do not support a choice") {
  Dataset set = swept(BenchKind::real);
  // the labels in another order in every replicate
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    static const std::vector<std::string> names{"denim", "silk", "wool"};
    const auto was =
        static_cast<std::size_t>(std::ranges::find(names, set.trials[i].label) - names.begin());
    set.trials[i].label = set.records[i].spec.label =
        names[(was + set.records[i].spec.repetition * (i % 2 + 1)) % 3];
  }
  SweepOptions options;
  options.resamples = 300;
  const auto found = analyse_sweep(std::span(&set, 1), options);
  REQUIRE(found);
  const SweepAnalysis& a = found->front();
  INFO(recommendation(a));
  REQUIRE_FALSE(a.choice.supported);
  CHECK_THAT(recommendation(a), Catch::Contains("do not support"));
  CHECK_THAT(recommendation(a), Catch::Contains("overlapping"));
  CHECK_THAT(render(design_section(a)), !Catch::Contains("SIMULATED"));
}

TEST_CASE("Sweeps with another rate, rig, device or an unknown bench are not combined") {
  const auto refused = [](auto change, BenchKind kind = BenchKind::simulated) {
    std::vector<Dataset> sets{swept(kind, 1), swept(kind, 2)};
    change(sets[1].info);
    const auto found = analyse_sweep(sets, {});
    REQUIRE_FALSE(found);
    return to_string(found.error());
  };
  CHECK_THAT(refused([](DatasetInfo& info) { info.taxel_rate_hz = 50; }),
             Catch::Contains("sample rates: 50 Hz (expected 37 Hz)"));
  CHECK_THAT(refused([](DatasetInfo& info) {
               info.rig_json.replace(info.rig_json.find("bench17"), 7, "bench18");
             }),
             Catch::Contains("rigs: bench18"));
  CHECK_THAT(refused([](DatasetInfo& info) {
               info.devices.push_back({"taxels", "array", "{}"});
             }),
             Catch::Contains("devices"));
  CHECK_THAT(refused([](DatasetInfo&) {}, BenchKind::unknown), Catch::Contains("unknown bench"));
}

TEST_CASE("The page of a sweep has a map of each figure, each labelled SIMULATED") {
  const SweepAnalysis a = analysed(swept(BenchKind::simulated));
  const std::string section = render(design_section(a));
  for (const char* words : {"Heat map of the separability", "texture signal over noise",
                            "taxel range", "recorded seconds"})
    CHECK_THAT(section, Catch::Contains(words));
  const auto figures = parts(section, "<figure", "</figure>");
  CHECK(figures.size() == 6);
  for (const std::string& figure : figures) CHECK_THAT(figure, Catch::Contains("SIMULATED"));
  // also in each picture itself, which may be copied out of the page
  const auto pictures = parts(section, "<svg", "</svg>");
  CHECK(pictures.size() == 5);
  for (const std::string& picture : pictures) CHECK_THAT(picture, Catch::Contains("SIMULATED"));
  const auto document = design_json(a);
  CHECK(document["bench"] == "simulated");
  CHECK(document["cells"].size() == 4);
  CHECK(document["recommendation"]["factors"]["speed_mps"] == 0.004);
  CHECK_THAT(render(design_document("t", BenchKind::simulated, design_section(a))),
             Catch::StartsWith("<!DOCTYPE html>"));
}

TEST_CASE("A campaign's report has the learning curve where there are repetitions enough") {
  std::vector<std::string> reported;
  const auto tell = [&](const std::string& what) { reported.push_back(what); };
  CHECK(analyse_design(repeated(5, 30), tell).blocks.empty());
  const DesignParts parts = analyse_design(repeated(7, 30), tell);
  const std::string shown = render(parts.blocks);
  CHECK_THAT(shown, Catch::Contains("Number of repetitions") && Catch::Contains("SIMULATED"));
  const auto document = nlohmann::json::parse(parts.json);
  CHECK(document["repetitions"][0]["predicted"]["repetitions"] == 14);
  CHECK(document["repetitions"][0]["curve"].size() == 5);
  CHECK(document["repetitions"][0]["draws"] == 1);
  CHECK_THAT(shown, Catch::Contains("drawn 1 time."));
  CHECK_THAT(render(analyse_design(swept(BenchKind::simulated), tell).blocks),
             Catch::Contains(": rub</h2>"));
}

TEST_CASE("Repetitions are the recorded ones by number, the first N, or strokes as drawn") {
  const Dataset set = repeated(11, 30);
  const auto features = classifier::build_feature_matrix(set.trials);
  REQUIRE(features);
  const auto first = by_repetition(*features, set, {.strokes = false, .first = 10, .seed = 1});
  CHECK(first.size() == 30);
  for (const std::string& file : first.files) CHECK(file != "t30");  // the 11th, not the "11"th
  const auto drawn = by_repetition(*features, set, {.strokes = true, .first = 4, .seed = 1});
  CHECK(drawn.size() == 12);
  const auto other = by_repetition(*features, set, {.strokes = true, .first = 4, .seed = 2});
  CHECK(drawn.files != other.files);
  // if a fabric lacks a trial of repetition 2, that repetition is left out, and every fabric has as
  // many strokes as the one with the fewest
  classifier::FeatureMatrix lacking = *features;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < lacking.size(); ++i)
    if (i != 4) rows.push_back(i);
  lacking = classifier::select_rows(lacking, rows);
  CHECK(by_repetition(lacking, set, {}).size() == 30);
  CHECK(by_repetition(lacking, set, {.strokes = true, .first = 0, .seed = 1}).size() == 30);
}

TEST_CASE("One trial without a recorded number makes the groups the repetitions of all") {
  Dataset set = repeated(6, 30);
  for (std::size_t i = 0; i < set.trials.size(); ++i)
    set.trials[i].group = "day " + std::to_string(i / 6);
  const auto features = classifier::build_feature_matrix(set.trials);
  REQUIRE(features);
  const auto numbered = by_repetition(*features, set, {});
  CHECK(std::set(numbered.groups.begin(), numbered.groups.end()).size() == 6);
  set.records[4].spec.repetition = 0;
  const auto named = by_repetition(*features, set, {});
  CHECK(std::set(named.groups.begin(), named.groups.end()) ==
        std::set<std::string>{"day 0", "day 1", "day 2"});
  CHECK(named.size() == 18);
}

}  // namespace design_test
