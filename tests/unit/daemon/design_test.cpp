// A sweep in memory: what an analysis finds of it, says of it, and refuses.

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "classifier/design/resample.hpp"
#include "daemon/design/campaign_design.hpp"
#include "daemon/design/design_json.hpp"
#include "daemon/design/design_page.hpp"
#include "daemon/design/repetition_study.hpp"
#include "daemon/design/sweep_analysis.hpp"
#include "recipes/engine/sweep_warnings.hpp"

using namespace weft;
using namespace weft::daemon;

namespace {

constexpr double frames_hz = 37;
constexpr std::size_t taxels = 2;

std::string bench17() {
  std::ifstream in(std::string(WEFT_SOURCE_DIR) + "/sim/rigs/bench17.json");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

const char* const swept_recipe = R"({
  "schema_version": 1, "name": "swept", "fabrics": ["denim", "silk", "wool"],
  "sweep": {"factors": [{"name": "force_N", "values": [3, 5]}, {"name": "speed_mm_s", "values": [1, 4]}],
            "replicates": 4},
  "explorations": {"rub": {"phases": [
    {"phase": "S", "duration_s": 1}, {"phase": "P", "force_N": 5, "duration_s": 1},
    {"phase": "M", "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 20}]},
    {"phase": "E", "duration_s": 1}]}}})";

/// Noise of one count, and in phase M a texture of 1 mm whose amplitude is the force's, about a
/// level that tells the fabrics apart by `gap` deviations.
void add_trial(Dataset& set, std::size_t fabric, std::size_t repetition, double force_n,
               double speed_mps, double gap, classifier::RandomEngine& engine) {
  static const std::vector<std::string> names{"denim", "silk", "wool"};
  classifier::Trial trial;
  trial.label = names[fabric];
  trial.group = std::to_string(repetition);
  trial.file = "t" + std::to_string(set.trials.size());
  trial.taxels = taxels;
  const auto motion = static_cast<std::size_t>(0.02 / speed_mps * frames_hz);
  const auto add = [&](Phase phase, std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i) {
      const double wave =
          phase == Phase::motion
              ? 20 * force_n *
                    std::sin(2 * M_PI * speed_mps / 1e-3 * static_cast<double>(i) / frames_hz)
              : 0;
      for (std::size_t t = 0; t < taxels; ++t)
        trial.counts.push_back(std::round(5000 + gap * static_cast<double>(fabric) + wave +
                                          classifier::design::normal_draw(engine)));
      trial.phase.push_back(phase);
    }
  };
  add(Phase::rest, 37);
  add(Phase::press, 37);
  add(Phase::motion, motion);
  add(Phase::end, 37);
  TrialRecord record;
  record.spec.index = static_cast<std::uint32_t>(set.trials.size());
  record.spec.label = trial.label;
  record.spec.group = trial.group;
  record.spec.repetition = static_cast<std::uint32_t>(repetition);
  if (!set.info.factors.empty()) {
    record.spec.exploration = "rub-" + std::to_string(static_cast<int>(force_n)) + "N-" +
                              std::to_string(static_cast<int>(speed_mps * 1e3)) + "mm_s";
    record.spec.factors = {force_n, speed_mps};
  } else {
    record.spec.exploration = "rub";
  }
  for (std::size_t i = 0; i < trial.samples(); ++i)
    record.t_ns.push_back(static_cast<std::int64_t>(static_cast<double>(i) / frames_hz * 1e9));
  set.trials.push_back(std::move(trial));
  set.records.push_back(std::move(record));
}

DatasetInfo info_of(BenchKind kind) {
  DatasetInfo info;
  info.kind = kind;
  info.name = "swept";
  info.recipe_json = swept_recipe;
  info.rig_json = bench17();
  info.taxel_rate_hz = frames_hz;
  return info;
}

/// The fabrics differ at 5 N alone.
Dataset swept(BenchKind kind, std::uint64_t seed = 1) {
  Dataset set;
  set.info = info_of(kind);
  set.info.factors = {"force_n", "speed_mps"};
  classifier::RandomEngine engine(seed);
  for (std::size_t r = 1; r <= 4; ++r)
    for (std::size_t fabric = 0; fabric < 3; ++fabric)
      for (const double force_n : {3.0, 5.0})
        for (const double speed_mps : {0.001, 0.004})
          add_trial(set, fabric, r, force_n, speed_mps, force_n > 4 ? 30 : 0, engine);
  return set;
}

Dataset repeated(std::size_t repetitions, double gap) {
  Dataset set;
  set.info = info_of(BenchKind::simulated);
  classifier::RandomEngine engine(3);
  for (std::size_t r = 1; r <= repetitions; ++r)
    for (std::size_t fabric = 0; fabric < 3; ++fabric)
      add_trial(set, fabric, r, 5, 0.004, gap, engine);
  return set;
}

/// All texts from `begin` to `end`.
std::vector<std::string> parts(const std::string& text, const std::string& begin,
                               const std::string& end) {
  std::vector<std::string> out;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1))
    out.push_back(text.substr(at, text.find(end, at) - at));
  return out;
}

SweepAnalysis analysed(const Dataset& set) {
  SweepOptions options;
  options.resamples = 300;
  const auto found = analyse_sweep(std::span(&set, 1), options);
  REQUIRE(found);
  REQUIRE(found->size() == 1);
  return found->front();
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
  CHECK_THAT(recommendation(a), Catch::StartsWith("Recommended is 5 N, 4 mm/s: 100.0 %"));
}

TEST_CASE("Where nothing differs the analysis says that the data do not support a choice") {
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
  CHECK_THAT(recommendation(a), Catch::StartsWith("The data do not support a choice"));
  CHECK_THAT(recommendation(a), Catch::Contains("interval that overlaps"));
  CHECK_THAT(design_section(a), !Catch::Contains("SIMULATED"));
}

TEST_CASE("Simulated and real sweeps are never mixed, and what is no sweep is refused") {
  const std::vector<Dataset> mixed{swept(BenchKind::simulated), swept(BenchKind::real)};
  const auto refused = analyse_sweep(mixed, {});
  REQUIRE_FALSE(refused);
  CHECK_THAT(to_string(refused.error()), Catch::Contains("never mixed"));
  const std::vector<Dataset> alike{swept(BenchKind::simulated, 1), swept(BenchKind::simulated, 2)};
  SweepOptions options;
  options.resamples = 100;
  const auto together = analyse_sweep(alike, options);
  REQUIRE(together);
  CHECK(together->front().replicates == 8);
  CHECK(together->front().datasets.size() == 2);
  const Dataset plain = repeated(6, 30);
  CHECK_THAT(to_string(analyse_sweep(std::span(&plain, 1), {}).error()),
             Catch::Contains("no sweep"));
  CHECK_FALSE(analyse_sweep({}, {}));
  const std::vector<Dataset> twice{swept(BenchKind::simulated, 1), swept(BenchKind::simulated, 1)};
  CHECK_THAT(to_string(analyse_sweep(twice, {}).error()), Catch::Contains("same data set twice"));
}

TEST_CASE(
    "Sweeps of another rate, rig or device are not taken together, nor those of who knows what") {
  const auto refused = [](auto change, BenchKind kind = BenchKind::simulated) {
    std::vector<Dataset> sets{swept(kind, 1), swept(kind, 2)};
    change(sets[1].info);
    const auto found = analyse_sweep(sets, {});
    REQUIRE_FALSE(found);
    return to_string(found.error());
  };
  CHECK_THAT(refused([](DatasetInfo& info) { info.taxel_rate_hz = 50; }),
             Catch::Contains("different sample rates (expected 37 Hz, got 50 Hz)"));
  CHECK_THAT(refused([](DatasetInfo& info) {
               info.rig_json.replace(info.rig_json.find("bench17"), 7, "bench18");
             }),
             Catch::Contains("different rigs") && Catch::Contains("got bench18"));
  CHECK_THAT(refused([](DatasetInfo& info) {
               info.devices.push_back({"taxels", "array", "{}"});
             }),
             Catch::Contains("different devices"));
  CHECK_THAT(refused([](DatasetInfo&) {}, BenchKind::unknown), Catch::Contains("unknown bench"));
}

TEST_CASE("A cell that holds other trials than most is named and left out") {
  Dataset set = swept(BenchKind::simulated);
  const auto in_cell = [&](std::size_t i, const char* name) {
    return set.records[i].spec.exploration == name;
  };
  for (std::size_t i = 0; i < set.trials.size(); ++i)
    if (in_cell(i, "rub-5N-1mm_s") && set.trials[i].label == "wool" && set.trials[i].group == "2")
      set.records[i].outcome = TrialOutcome::failed;
  const SweepAnalysis a = analysed(set);
  CHECK(a.cells.size() == 3);
  REQUIRE(a.left_out.size() == 1);
  CHECK(a.left_out[0].factors == std::vector<double>{5, 0.001});
  CHECK(left_out_words(a) ==
        "Left out, 5 N, 1 mm/s: it holds other trials than most cells: wool in 3 trials instead of "
        "4\n");
  CHECK_THAT(design_section(a), Catch::Contains("wool in 3 trials"));
  CHECK(design_json(a)["left_out"][0]["factors"]["force_n"] == 5);
  // a whole replicate less
  for (std::size_t i = 0; i < set.trials.size(); ++i)
    if (in_cell(i, "rub-3N-1mm_s") && set.trials[i].group == "2")
      set.records[i].outcome = TrialOutcome::failed;
  CHECK_THAT(left_out_words(analysed(set)),
             Catch::Contains("3 N, 1 mm/s") && Catch::Contains("3 replicates instead of 4"));
}

TEST_CASE("A cell that cannot be measured does not lose the others") {
  Dataset set = swept(BenchKind::simulated);
  const auto fail_from = [&](const std::string& name, std::uint32_t repetition) {
    for (TrialRecord& record : set.records)
      if (record.spec.exploration == name && record.spec.repetition >= repetition)
        record.outcome = TrialOutcome::failed;
  };
  fail_from("rub-3N-1mm_s", 3);  // two replicates are left
  fail_from("rub-3N-4mm_s", 1);  // none
  const SweepAnalysis a = analysed(set);
  CHECK(a.cells.size() == 2);
  REQUIRE(a.left_out.size() == 2);
  CHECK_THAT(a.left_out[0].why, Catch::Contains("too few replicates"));
  CHECK_THAT(a.left_out[1].why, Catch::Contains("no complete trial"));
  fail_from("rub-5N-1mm_s", 3);
  fail_from("rub-5N-4mm_s", 3);
  const auto none = analyse_sweep(std::span(&set, 1), {});
  REQUIRE_FALSE(none);
  CHECK_THAT(to_string(none.error()),
             Catch::Contains("no cell can be analysed") && Catch::Contains("too few replicates"));
}

TEST_CASE("The checker warns of what the analysis cannot do, and of no more") {
  const auto answers = [](std::size_t press, std::size_t motion) {
    classifier::Trial trial;
    trial.taxels = 1;
    trial.phase.assign(press, Phase::press);
    trial.phase.insert(trial.phase.end(), motion, Phase::motion);
    for (std::size_t i = 0; i < press + motion; ++i) trial.counts.push_back(double(i % 3));
    return classifier::design::response_of(trial, frames_hz, 0.004, 0, 65535).has_value();
  };
  CHECK(answers(recipes::least_press_samples, recipes::least_motion_samples));
  CHECK_FALSE(answers(recipes::least_press_samples - 1, recipes::least_motion_samples));
  CHECK_FALSE(answers(recipes::least_press_samples, recipes::least_motion_samples - 1));
  Dataset set = swept(BenchKind::simulated);
  const auto keep = [&](std::size_t replicates) {
    for (TrialRecord& record : set.records)
      if (record.spec.repetition > replicates) record.outcome = TrialOutcome::failed;
    return analyse_sweep(std::span(&set, 1), {}).has_value();
  };
  CHECK(keep(recipes::least_swept_replicates));
  CHECK_FALSE(keep(recipes::least_swept_replicates - 1));
}

TEST_CASE("An exploration none of whose cells is left is named, the others are analysed") {
  Dataset set = swept(BenchKind::simulated);
  std::string& recipe = set.info.recipe_json;
  const std::string rub = recipe.substr(recipe.find("{\"phases\""));
  recipe.replace(recipe.rfind("}}}"), 3, "}, \"tap\": " + rub);
  const SweepAnalysis a = analysed(set);
  CHECK(a.exploration == "rub");
  REQUIRE(a.without.size() == 1);
  CHECK_THAT(left_out_words(a), Catch::StartsWith("Left out, tap: no cell can be analysed"));
}

TEST_CASE("The page of a sweep has a map of each figure, each labelled SIMULATED") {
  const SweepAnalysis a = analysed(swept(BenchKind::simulated));
  const std::string section = design_section(a);
  for (const char* words : {"separability of the fabrics", "texture signal over noise",
                            "end of the taxels", "seconds on record"})
    CHECK_THAT(section, Catch::Contains(words));
  const auto figures = parts(section, "<figure", "</figure>");
  CHECK(figures.size() == 6);
  for (const std::string& figure : figures) CHECK_THAT(figure, Catch::Contains("SIMULATED"));
  // and in each picture itself, which may be taken from the page
  const auto pictures = parts(section, "<svg", "</svg>");
  CHECK(pictures.size() == 5);
  for (const std::string& picture : pictures) CHECK_THAT(picture, Catch::Contains("SIMULATED"));
  const auto document = design_json(a);
  CHECK(document["bench"] == "simulated");
  CHECK(document["cells"].size() == 4);
  CHECK(document["recommendation"]["factors"]["speed_mps"] == 0.004);
  CHECK_THAT(design_page("t", BenchKind::simulated, section), Catch::StartsWith("<!DOCTYPE html>"));
}

TEST_CASE("A campaign's report has the learning curve where there are repetitions enough") {
  std::vector<std::string> told;
  const auto tell = [&](const std::string& what) { told.push_back(what); };
  CHECK(design_of(repeated(5, 30), tell).html.empty());
  const DesignParts parts = design_of(repeated(7, 30), tell);
  CHECK_THAT(parts.html, Catch::Contains("How many repetitions") && Catch::Contains("SIMULATED"));
  const auto document = nlohmann::json::parse(parts.json);
  CHECK(document["repetitions"][0]["predicted"]["repetitions"] == 14);
  CHECK(document["repetitions"][0]["curve"].size() == 5);
  CHECK(document["repetitions"][0]["draws"] == 1);
  CHECK_THAT(parts.html, Catch::Contains("each size drawn 1 time;"));
  CHECK_THAT(design_of(swept(BenchKind::simulated), tell).html,
             Catch::Contains("Which setting: rub"));
}

TEST_CASE("Repetitions are the recorded ones by number, the first so many, or strokes as drawn") {
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
  // without one trial of repetition 2 that repetition is left out, and strokes are as few as those
  // of the fabric that has fewest
  classifier::FeatureMatrix lacking = *features;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < lacking.size(); ++i)
    if (i != 4) rows.push_back(i);
  lacking = classifier::take_rows(lacking, rows);
  CHECK(by_repetition(lacking, set, {}).size() == 30);
  CHECK(by_repetition(lacking, set, {.strokes = true, .first = 0, .seed = 1}).size() == 30);
}

TEST_CASE("One trial whose number is not on record makes the groups the repetitions of all") {
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
