// The recipe space, the margin of the table's promises, and promises compared with whole runs.

#include "daemon/analysis/tradeoff/sim/promise_table.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>

#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace promise_table_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

constexpr double weight_n = 1.96;
const std::vector<std::string> two_fabrics{"denim", "nylon"};

std::string fabrics_text() {
  return test::read_file(test::source / "sim/fabrics.json");
}

/// Trials of three scenes, each of which is held out once.
struct ThreeScenes {
  std::vector<TrialErrors> trials;
  std::vector<std::size_t> scene_of;

  void add(std::size_t scene, const std::string& fabric, double error_n, std::size_t count = 1) {
    trials.insert(trials.end(), count, {fabric, 1, {error_n, 2 * error_n}});
    scene_of.insert(scene_of.end(), count, scene);
  }
  [[nodiscard]] sim::Margin margin() const { return find_margins(2, trials, scene_of, 1).front(); }
};

/// The last scene has an error of `error_n`, the others of 1 N.
ThreeScenes denim_scenes(double error_n, std::size_t count = 20) {
  ThreeScenes out;
  for (const std::size_t scene : {0, 1}) out.add(scene, "denim", 1, count);
  out.add(2, "denim", error_n, count);
  return out;
}

/// A table of few scenes and settings.
PromiseTableOptions short_options() {
  using sim::Integrator, sim::Level, sim::grid_step_s;
  PromiseTableOptions out;
  out.scenes = 6;
  out.seeds = 1;
  out.rig_json = test::bench17().dump();
  out.fabrics_json = fabrics_text();
  out.settings = {{Level::quasistatic, Integrator::midpoint, grid_step_s},
                  {Level::dynamic, Integrator::adaptive, grid_step_s / 8},
                  {Level::dynamic, Integrator::adaptive, grid_step_s / 16},
                  {Level::modal, Integrator::adaptive, grid_step_s / 16}};
  return out;
}

/// Marks the margins as valid, so that the table is read; its runs test them.
sim::FidelityTable called_held(sim::FidelityTable table) {
  for (sim::MeasuredSetting& row : table.settings)
    row.margin.held_share = row.any_margin.held_share = table.conditions.share;
  return table;
}

/// A campaign of one random recipe, on a rig that chooses from `table`. The scene's fabric is
/// scaled like those of the table's measurements, because the rows are for such fabrics.
CampaignRequest scene_request(const TemporaryFolder& folder, const RecipeScene& scene,
                              std::uint64_t seed, sim::FidelityTable table) {
  const std::string fabrics = *scene_fabrics(fabrics_text(), scene);
  json rig = json::parse(*scene_rig(test::bench17().dump(), scene));
  rig["simulation"]["fidelity"] = (folder / "table.json").string();
  table.fabrics_sha256 = sha256_hex(fabrics);
  test::write_file(folder / "table.json", sim::to_json(called_held(std::move(table))));
  test::write_file(folder / "fabrics.json", fabrics);
  CampaignRequest request = test::request_in(folder, scene_recipe(scene, seed), rig);
  request.fidelity.probe_us = 50;
  return request;
}

/// Result of a run of the scene for its promise, and the setting. No promise: the table has none
/// for this accuracy, or no trial was complete.
struct SceneRun {
  std::optional<SimulationPromise> promise;
  std::string setting;
  bool is_refused = false, is_missed = false;
};

SceneRun run_scene(const RecipeScene& scene, std::uint64_t seed, const sim::FidelityTable& table,
                   std::span<const double> accuracies_n) {
  const TemporaryFolder folder;
  CampaignRequest request = scene_request(folder, scene, seed, table);
  INFO(scene_recipe(scene, seed));
  Result<SettledRequest> settled = fail({.code = Errc::unsupported});
  for (const double accuracy_n : accuracies_n) {
    request.fidelity.accuracy_n = accuracy_n;
    settled = settled_request(request);
    if (settled) break;
  }
  if (!settled) return {.promise = {}, .setting = {}, .is_refused = true};
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  SceneRun out{{}, summary->simulation.setting};
  if (summary->trials_complete == 0) {
    REQUIRE(summary->error);
    WARN(scene_recipe(scene, seed) << ": " << to_string(*summary->error));
    return out;
  }
  out.promise = summary->simulation.promise;
  out.is_missed = is_promise_missed(summary->simulation);
  REQUIRE(out.promise);
  REQUIRE(out.promise->checked_pairs == 1);
  CHECK(out.promise->promised_n <= out.promise->requested_n);
  return out;
}

/// Numbers of runs with an error within the table's promise, and within the requested accuracy.
struct PromiseCount {
  std::size_t runs = 0, promises_held = 0, requests_held = 0, refused = 0, incomplete = 0;
};

/// Runs `count` recipes with `seeds` seeds each. Every run prints its result.
PromiseCount hold_promises(const sim::FidelityTable& table, std::size_t count, std::size_t seeds,
                           std::uint64_t space_seed) {
  const auto library = sim::parse_fabrics(fabrics_text());
  REQUIRE(library);
  const auto scenes = draw_recipe_scenes(library->names(), weight_n, count, space_seed);
  constexpr double accuracies_n[]{0.05, 0.3, 2};
  PromiseCount out;
  for (std::size_t i = 0; i < scenes.size() * seeds; ++i) {
    const RecipeScene& scene = scenes[i / seeds];
    const SceneRun run =
        run_scene(scene, 1 + i % seeds, table, std::span(accuracies_n).subspan(i % 3));
    out.refused += run.is_refused ? 1 : 0;
    out.incomplete += !run.promise && !run.is_refused ? 1 : 0;
    if (!run.promise) continue;
    const SimulationPromise& promise = *run.promise;
    const bool kept_request = promise.is_resolved && promise.measured_n <= promise.requested_n;
    const bool kept_promise = promise.is_resolved && promise.measured_n <= promise.promised_n;
    CHECK(promise.held == kept_request);
    CHECK(run.is_missed == !kept_request);
    ++out.runs;
    out.requests_held += kept_request ? 1 : 0;
    out.promises_held += kept_promise ? 1 : 0;
    if (!kept_promise)
      WARN(scene.fabric << ": asked " << promise.requested_n << " N, promised "
                        << promise.promised_n << " N, measured " << promise.measured_n
                        << " N in phase " << promise.phase << " at " << run.setting);
  }
  return out;
}

/// The table with one setting, which promises `promise_n` on the scene's fabric.
sim::FidelityTable promising(sim::FidelityTable table, const std::string& setting,
                             const std::string& fabric, double promise_n) {
  std::erase_if(table.settings, [&](const auto& row) { return to_string(row.setting) != setting; });
  REQUIRE(table.settings.size() == 1);
  table.settings.front().margin.factor = 1;
  table.settings.front().cloths = {{fabric, 1, promise_n, promise_n, promise_n}};
  return table;
}

}  // namespace

TEST_CASE("scenes stay inside their ranges, a fifth of the forces below the weight") {
  const auto scenes = draw_recipe_scenes(two_fabrics, weight_n, 200, 7);
  sim::TableConditions conditions;
  write_ranges(conditions);
  std::size_t below = 0;
  std::set<std::string> fabrics;
  std::set<ScenePath> paths;
  for (const RecipeScene& scene : scenes) {
    CHECK(conditions.force_n.contains(scene.force_n));
    CHECK(conditions.speed_mps.contains(scene.speed_mps));
    CHECK(conditions.seat_speed_mps.contains(scene.seat_speed_mps));
    CHECK(conditions.press_s.contains(scene.press_s));
    CHECK(conditions.mount_stiffness_n_m.contains(scene.mount_stiffness_n_m));
    CHECK(conditions.slack_m.contains(scene.slack_m));
    CHECK(std::abs(scene.force_n / weight_n - 1) > 0.09);  // the loop has no set point near the
                                                           // probe's weight
    CHECK(scene.lambda_scale >= 0.7);
    CHECK(scene.lambda_scale <= 1.4);
    below += scene.force_n < weight_n ? 1 : 0;
    fabrics.insert(scene.fabric);
    paths.insert(scene.path);
  }
  CHECK(below == 40);
  CHECK(fabrics.size() == 2);
  CHECK(paths.size() == 4);
}

TEST_CASE("a Latin hypercube has a scene in each part of a range, and is the same each time") {
  constexpr std::size_t count = 50;
  const auto scenes = draw_recipe_scenes(two_fabrics, weight_n, count, 3);
  sim::TableConditions conditions;
  write_ranges(conditions);
  std::set<std::size_t> parts;
  for (const RecipeScene& scene : scenes)
    parts.insert(
        static_cast<std::size_t>(count * (scene.speed_mps - conditions.speed_mps.least) /
                                 (conditions.speed_mps.most - conditions.speed_mps.least)));
  CHECK(parts.size() >= count - 1);  // rounding at the parts' ends
  const auto again = draw_recipe_scenes(two_fabrics, weight_n, count, 3);
  const auto other = draw_recipe_scenes(two_fabrics, weight_n, count, 4);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < count; ++i) {
    CHECK(scene_recipe(again[i], 1) == scene_recipe(scenes[i], 1));
    differ += scene_recipe(other[i], 1) != scene_recipe(scenes[i], 1) ? 1 : 0;
  }
  CHECK(differ == count);
}

TEST_CASE("a rig can run every scene's recipe, and a scaled cloth has a scaled lambda") {
  const auto library = sim::parse_fabrics(fabrics_text());
  REQUIRE(library);
  for (const RecipeScene& scene : draw_recipe_scenes(library->names(), weight_n, 34, 5)) {
    const auto rig = scene_rig(test::bench17().dump(), scene);
    REQUIRE(rig);
    const auto limits = recipes::parse_rig_limits(*rig);
    if (!limits) FAIL(to_string(limits.error()));
    const auto checked = recipes::check_recipe(scene_recipe(scene, 1), *limits);
    for (const auto& problem : checked.problems) FAIL(recipes::to_string(problem));
    const auto scaled = sim::parse_fabrics(*scene_fabrics(fabrics_text(), scene));
    REQUIRE(scaled);
    const auto law = sim::law_from_kes(library->find(scene.fabric)->kes);
    const auto scaled_law = sim::law_from_kes(scaled->find(scene.fabric)->kes);
    REQUIRE(law);
    REQUIRE(scaled_law);
    CHECK(scaled_law->lambda_m == Approx(scene.lambda_scale * law->lambda_m));
    CHECK(scaled_law->pressure_pa == Approx(law->pressure_pa));
  }
}

TEST_CASE("the margin is the least that keeps 99 of 100 runs that were held back") {
  CHECK(denim_scenes(0.9).margin().factor == 1);
  CHECK(denim_scenes(0.9).margin().held_share == 1);
  CHECK(denim_scenes(1.05).margin().factor == 1.1);
  CHECK(denim_scenes(1.3).margin().factor == 1.5);
  CHECK(denim_scenes(2.2).margin().factor == 2.5);
  CHECK(denim_scenes(3.9).margin().factor == 4);
  // one trial in 100 000 affects less than a hundredth of the runs; so does one in 1000 if a run
  // has only one trial
  for (const auto& [count, factor] : {std::pair<std::size_t, double>{33'333, 1}, {333, 1.25}}) {
    ThreeScenes seldom = denim_scenes(0.9, count);
    seldom.add(2, "denim", 1.2);
    CHECK(seldom.margin().factor == factor);
    CHECK(seldom.margin().held_share >= promised_share);
  }
  // a fabric that the other scenes lack has no promise to break
  ThreeScenes unknown = denim_scenes(0.9);
  unknown.add(0, "wool", 50);
  CHECK(unknown.margin().factor == 1);
  // another fabric with a larger permitted error must not hide a miss
  ThreeScenes two = denim_scenes(2.8);
  for (const std::size_t scene : {0, 1, 2}) two.add(scene, "nylon", 10, 20);
  CHECK(two.margin().factor == 3);
}

TEST_CASE("each setting has the margin that it needs itself") {
  ThreeScenes scenes = denim_scenes(0.9);
  for (TrialErrors& trial : scenes.trials) trial.error_n[1] = trial.error_n[0] < 1 ? 2.8 : 1;
  const auto margins = find_margins(2, scenes.trials, scenes.scene_of, 1);
  CHECK(margins[0].factor == 1);
  CHECK(margins[1].factor == 3);
  for (TrialErrors& trial : scenes.trials) trial.fabric = trial.error_n[0] < 1 ? "nylon" : "denim";
  const auto any = find_any_margins(2, scenes.trials);
  CHECK(any[0].factor == 1.25);  // denim has an error of 1 N, nylon of 0.9 N
  CHECK(any[1].factor == 3);
  const auto table = summarize_errors({{}, {}}, scenes.trials, scenes.scene_of, 1);
  CHECK(table.settings[0].any_margin.factor == any[0].factor);
  CHECK(table.settings[1].any_margin.factor == any[1].factor);
}

TEST_CASE("a margin that does not hold is reported, and its table is refused") {
  const sim::Margin none = denim_scenes(40).margin();
  CHECK(none.factor == 16);
  CHECK(none.held_share == Approx(2.0 / 3).margin(1e-3));
  CHECK(find_margins(1, {}, {}, 1).front().held_share == 0);
  CHECK(denim_scenes(HUGE_VAL).margin().held_share < promised_share);
  sim::FidelityTable table;
  table.settings.resize(2);
  CHECK(check_margins(table).error().code == Errc::unsupported);
  table.settings[0].margin.held_share = table.settings[0].any_margin.held_share = promised_share;
  table.settings[1].margin.held_share = promised_share;
  CHECK(check_margins(table).error().where == "/settings/1/any/held_share");
  table.settings[1].any_margin.held_share = promised_share;
  CHECK(check_margins(table));
  table.settings[0].margin = none;
  CHECK(check_margins(table).error().where == "/settings/0/held_share");
}

TEST_CASE("the margin of a cloth without a row is that of each cloth against all others") {
  ThreeScenes scenes = denim_scenes(1);
  scenes.add(0, "nylon", 1.4, 20);
  const sim::Margin any = find_any_margins(2, scenes.trials).front();
  CHECK(any.factor == 1.5);
  CHECK(any.held_share == 1);
  for (TrialErrors& trial : scenes.trials)
    if (trial.fabric == "nylon") trial.scale_n = 2;  // it hits harder, but its error is the same
  CHECK(find_any_margins(2, scenes.trials).front().factor == 1.5);  // denim, against 0.7 of nylon
  // no other scene for comparison
  CHECK(find_any_margins(2, denim_scenes(1).trials).front().held_share == 0);
}

TEST_CASE("errors become quantiles of each cloth, and shares of the impact scale") {
  std::vector<TrialErrors> trials;
  std::vector<std::size_t> scenes;
  for (std::size_t i = 0; i < 200; ++i) {
    const double error_n = static_cast<double>(i + 1);
    trials.push_back({i % 2 == 0 ? "denim" : "nylon", 10, {error_n}});
    scenes.push_back(i / 2);
  }
  const auto table = summarize_errors({{.level = sim::Level::quasistatic}}, trials, scenes, 4);
  REQUIRE(table.settings.size() == 1);
  const sim::MeasuredSetting& row = table.settings.front();
  REQUIRE(row.cloths.size() == 2);
  CHECK(row.cloths[0].fabric == "denim");
  CHECK(row.cloths[0].runs == 100);
  CHECK(row.cloths[0].q50_n == 99);
  CHECK(row.cloths[0].q99_n == 197);
  CHECK(row.cloths[0].max_n == 199);
  CHECK(row.cloths[1].max_n == 200);
  CHECK(row.any_max == 20);
  CHECK(table.conditions.space_seed == 4);
}

TEST_CASE("a short table is measured and read back, and runs hold their promises against it") {
  const auto table = measure_promise_table(short_options(), process_cpu_seconds);
  if (!table) FAIL(to_string(table.error()));
  const std::string text = sim::to_json(called_held(*table));
  const auto back = sim::parse_fidelity(text);
  if (!back) FAIL(to_string(back.error()));
  CHECK(sim::to_json(*back) == text);
  REQUIRE(back->settings.size() == 4);
  CHECK(back->settings[3].setting.level == sim::Level::modal);  // has the force of L2
  CHECK(back->settings[3].any_max == back->settings[2].any_max);
  CHECK(back->settings[3].contact_us_per_s == back->settings[2].contact_us_per_s);
  // the model limits L1; half the step gives a quarter of the error
  CHECK(back->settings[0].any_max > back->settings[1].any_max);
  CHECK(back->settings[1].any_max > back->settings[2].any_max);
  CHECK(back->conditions.reference == "L2 tr_bdf2 0.048 ms");
  CHECK(back->host_cost.emulators_us_per_s > 0);
  CHECK(back->host_cost.full_check_us_per_s > back->host_cost.quick_check_us_per_s);
  const PromiseCount count = hold_promises(*table, 4, 1, 11);
  CHECK(count.runs > 0);
  CHECK(count.incomplete == 0);
  CHECK(count.requests_held > 0);  // a table of six trials cannot give more
}

TEST_CASE("the shipped table fits the engine and the shipped cloths") {
  const auto table = sim::parse_fidelity(test::read_file(test::source / "sim/fidelity.json"));
  if (!table) FAIL(to_string(table.error()));
  CHECK(table->rules == recipes::engine_rules);
  CHECK(table->fabrics_sha256 == sha256_hex(fabrics_text()));
}

TEST_CASE("where a table promises a quarter of what its runs err by, every run is missed") {
  auto options = short_options();
  options.scenes = 1;
  const auto table = measure_promise_table(options, process_cpu_seconds);
  if (!table) FAIL(to_string(table.error()));
  const auto library = sim::parse_fabrics(fabrics_text());
  REQUIRE(library);
  constexpr double any_n[]{1000};
  std::size_t runs = 0;
  for (const RecipeScene& scene : draw_recipe_scenes(library->names(), weight_n, 4, 12)) {
    const SceneRun first = run_scene(scene, 1, *table, any_n);
    if (!first.promise) continue;
    const double quarter_n[]{first.promise->measured_n / 4};
    const SceneRun again = run_scene(
        scene, 1, promising(*table, first.setting, scene.fabric, quarter_n[0]), quarter_n);
    REQUIRE(again.promise);
    CHECK(again.setting == first.setting);
    CHECK(again.is_missed);
    CHECK_FALSE(again.promise->held);
    ++runs;
  }
  CHECK(runs > 0);
}

// Hidden, because it takes some minutes: script/bench promise
TEST_CASE("the shipped table's promises hold for 99 of 100 random runs", "[.][promise]") {
  const auto table = sim::parse_fidelity(test::read_file(test::source / "sim/fidelity.json"));
  if (!table) FAIL(to_string(table.error()));
  const PromiseCount count = hold_promises(*table, 20, 5, 2);
  WARN("of " << count.runs << " runs " << count.promises_held << " kept the promise and "
             << count.requests_held << " the request; " << count.refused << " refused, "
             << count.incomplete << " without a complete trial");
  CHECK(count.refused + count.incomplete <= 1);
  const double least = promised_share * static_cast<double>(count.runs);
  CHECK(static_cast<double>(count.promises_held) >= least);
  CHECK(static_cast<double>(count.requests_held) >= least);
}

}  // namespace promise_table_test
