// Cells of sweeps that are compared with each other, and those left out by name.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "classifier/design/response.hpp"
#include "daemon/analysis/design/design_page.hpp"
#include "recipes/engine/recipe_reader.hpp"
#include "tests/unit/daemon/analysis/swept_data.hpp"

namespace swept_cells_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test_sweep;

TEST_CASE("Simulated and real sweeps are not mixed, and a data set without sweep is refused") {
  const std::vector<Dataset> mixed{swept(BenchKind::simulated), swept(BenchKind::real)};
  const auto refused = analyse_sweep(mixed, {});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().expected == "simulated");
  CHECK(refused.error().got == "real");
  const std::vector<Dataset> alike{swept(BenchKind::simulated, 1), swept(BenchKind::simulated, 2)};
  SweepOptions options;
  options.resamples = 100;
  const auto together = analyse_sweep(alike, options);
  REQUIRE(together);
  CHECK(together->front().replicates == 8);
  CHECK(together->front().datasets.size() == 2);
  const Dataset plain = repeated(6, 30);
  CHECK_THAT(analyse_sweep(std::span(&plain, 1), {}).error().expected,
             Catch::Contains("\"sweep\""));
  CHECK_FALSE(analyse_sweep({}, {}));
  const std::vector<Dataset> twice{swept(BenchKind::simulated, 1), swept(BenchKind::simulated, 1)};
  CHECK_THAT(analyse_sweep(twice, {}).error().what, Catch::Contains("twice"));
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
  CHECK_THAT(format_left_out(a), Catch::Contains(": 5 N, 1 mm/s: ") &&
                                     Catch::EndsWith(": wool in 3 trials instead of 4\n"));
  CHECK_THAT(render(design_section(a)), Catch::Contains("wool in 3 trials"));
  CHECK(design_json(a)["left_out"][0]["factors"]["force_n"] == 5);
  // without one whole replicate
  for (std::size_t i = 0; i < set.trials.size(); ++i)
    if (in_cell(i, "rub-3N-1mm_s") && set.trials[i].group == "2")
      set.records[i].outcome = TrialOutcome::failed;
  CHECK_THAT(format_left_out(analysed(set)),
             Catch::Contains("3 N, 1 mm/s") && Catch::Contains("3 replicates instead of 4"));
}

TEST_CASE("A cell that cannot be measured does not lose the others") {
  Dataset set = swept(BenchKind::simulated);
  const auto fail_from = [&](const std::string& name, std::uint32_t repetition) {
    for (TrialRecord& record : set.records)
      if (record.spec.exploration == name && record.spec.repetition >= repetition)
        record.outcome = TrialOutcome::failed;
  };
  fail_from("rub-3N-1mm_s", 3);  // two replicates remain
  fail_from("rub-3N-4mm_s", 1);  // none
  const SweepAnalysis a = analysed(set);
  CHECK(a.cells.size() == 2);
  REQUIRE(a.left_out.size() == 2);
  CHECK_THAT(a.left_out[0].why, Catch::Contains("too few replicates"));
  CHECK_THAT(a.left_out[1].why, Catch::Contains("complete trials"));
  fail_from("rub-5N-1mm_s", 3);
  fail_from("rub-5N-4mm_s", 3);
  const auto none = analyse_sweep(std::span(&set, 1), {});
  REQUIRE_FALSE(none);
  CHECK_THAT(to_string(none.error()),
             Catch::Contains("first cell") && Catch::Contains("too few replicates"));
}

TEST_CASE("The checker warns exactly of what the analysis refuses") {
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

TEST_CASE("An exploration without usable cells is named, the others are analysed") {
  Dataset set = swept(BenchKind::simulated);
  std::string& recipe = set.info.recipe_json;
  const std::string rub = recipe.substr(recipe.find("{\"phases\""));
  recipe.replace(recipe.rfind("}}}"), 3, "}, \"tap\": " + rub);
  const SweepAnalysis a = analysed(set);
  CHECK(a.exploration == "rub");
  REQUIRE(a.without.size() == 1);
  CHECK_THAT(format_left_out(a), Catch::Contains(": tap: "));
}

}  // namespace swept_cells_test
