// A rig's choice of its fidelity level, the omitted computations, and the difference from a finer
// level.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "protocols/rdt/rdt.hpp"
#include "sim/devices/replay.hpp"
#include "sim/plant/fidelity/reference.hpp"
#include "sim/rig/rig_config.hpp"
#include "sim/rig/simulation_choice.hpp"
#include "tests/unit/sim/support.hpp"

namespace level_test {

using namespace weft;
using namespace weft::sim;
using nlohmann::json;
using test::bench17_with;

namespace {

using Changes = std::vector<std::pair<std::string, std::string>>;

Level level_of(const Changes& changes) {
  const auto config = parse_rig_config(bench17_with(changes));
  if (!config) FAIL(to_string(config.error()));
  return config->bench_plant.plant.level;
}

Error refusal_of(const std::string& rig) {
  const auto config = parse_rig_config(rig);
  REQUIRE_FALSE(config);
  return config.error();
}

std::string refusal(const std::string& rig) {
  return to_string(refusal_of(rig));
}

/// bench17 without the devices of these roles.
std::string bench17_without(const std::vector<std::string>& roles) {
  json rig = json::parse(test::bench17_text()), saved = json::array();
  for (const json& device : rig["devices"])
    if (std::find(roles.begin(), roles.end(), device["role"]) == roles.end())
      saved.push_back(device);
  rig["devices"] = saved;
  return rig.dump();
}

SimulationChoice choice_of(const std::string& rig, const SimulationRequest& request,
                           const FidelityTable* table = nullptr) {
  auto choice = choose_simulation(rig, request, table);
  if (!choice) FAIL(to_string(choice.error()));
  return *choice;
}

/// Errors of denim.
MeasuredSetting measured(const FidelitySetting& setting, double error_n, double contact_us) {
  return {.setting = setting,
          .contact_us_per_s = contact_us,
          .cloths = {{"denim", 1, error_n, error_n, error_n}},
          .any_q99 = error_n,
          .any_max = error_n};
}

FidelityTable table_of(const std::vector<MeasuredSetting>& settings) {
  FidelityTable table;
  table.conditions.force_n = {0.2, 10};
  table.conditions.seat_speed_mps = {1e-4, 1e-3};
  table.conditions.mount_stiffness_n_m = {1e4, 5e4};
  table.conditions.slack_m = {0.6e-3, 3e-3};
  table.settings = settings;
  return table;
}

const FidelitySetting l1{Level::quasistatic, Integrator::midpoint, grid_step_s};
const FidelitySetting coarse_l2{Level::dynamic, Integrator::tr_bdf2, 1e-3};
const std::string traits = "/simulation/traits", level = "/simulation/level";

}  // namespace

TEST_CASE("a rig's level is the least that gives its sensors and traits") {
  CHECK(level_of({}) == Level::quasistatic);
  CHECK(level_of({{traits, "[]"}}) == Level::algebraic);
  CHECK(level_of({{traits, R"(["mean_level"])"}}) == Level::algebraic);
  CHECK(level_of({{traits, R"(["relaxation"])"}}) == Level::quasistatic);
  CHECK(level_of({{traits, R"(["regulated_force", "stick_slip"])"}}) == Level::dynamic);
  for (const Level by_hand : {Level::quasistatic, Level::dynamic, Level::modal})
    CHECK(level_of({{level, '"' + std::string(to_string(by_hand)) + '"'}}) == by_hand);
  json rig = json::parse(test::bench17_text());
  rig["simulation"].erase("level");
  CHECK(parse_rig_config(rig.dump())->bench_plant.plant.level == Level::quasistatic);
}

TEST_CASE("a level that cannot produce the scene is refused with the scene's sentence") {
  const Error relaxation = refusal_of(bench17_with({{level, R"("L0")"}}));
  CHECK(relaxation.where == "/simulation/level");
  CHECK(relaxation.what.find("relaxation") != std::string::npos);
  CHECK(relaxation.expected == "L1 or above");
  CHECK(relaxation.got == "L0");
  const Error overshoot =
      refusal_of(bench17_with({{level, R"("L1")"}, {traits, R"(["overshoot"])"}}));
  CHECK(overshoot.what.find("overshoot") != std::string::npos);
  CHECK(overshoot.expected == "L2 or above");
  const Error moving = refusal_of(bench17_with({{level, R"("Z")"}}));
  CHECK(moving.what.find("stage positions") != std::string::npos);
  CHECK(moving.got == "Z");
  const Error both = refusal_of(bench17_with({{traits, R"(["neighbour_load"])"}}));
  CHECK(both.code == Errc::unsupported);
  CHECK(both.what.find("no level") != std::string::npos);
  CHECK(refusal(bench17_with({{traits, R"(["slip"])"}})).find("/simulation/traits/0") == 0);
  CHECK(refusal(bench17_with({{traits, R"(["overshoot", "overshoot"])"}})).find("twice") !=
        std::string::npos);
}

TEST_CASE("a channel is not a device") {
  const auto kind = [](const std::string& name) {
    return refusal(bench17_with({{"/devices/6/emulator/kind", '"' + name + '"'}}));
  };
  CHECK(kind("accelerometer").find("vibro") != std::string::npos);
  CHECK(kind("microphone").find("vibro") != std::string::npos);
}

TEST_CASE("a level that follows from the scene and the same one by hand make the same run") {
  const auto forces = [](const std::string& rig_json) {
    auto rig = test::make_rig(rig_json, 1);
    test::TestLoop loop;
    test::TestLink taxels(loop);
    REQUIRE(rig->attach("taxels", taxels, loop));
    REQUIRE(rig->mount("felt", 3, loop.now()));
    loop.run_for(1);
    return taxels.received;
  };
  CHECK(forces(test::bench17_text()) == forces(bench17_with({{level, R"("L1")"}})));
}

TEST_CASE("a rig without pads presses none, one without any force has no contact") {
  test::TestLoop loop;
  const auto pressed = [&](const std::string& text) {
    // The plate is at 60 mm: the probe starts 2 mm inside the fabric, at rest in its slack.
    json rig = json::parse(text);
    for (json& device : rig["devices"])
      if (device["role"] == "z") device["emulator"]["start_mm"] = 59.5;
    auto made = test::make_rig(rig.dump(), 1);
    REQUIRE(made->mount("terry", 1, {}));
    return made;
  };
  const TimePoint later{std::chrono::seconds(2)};
  auto whole = pressed(test::bench17_text());
  const double force_n = whole->truth(later).contact_force_n;
  CHECK(force_n > 1);
  CHECK(whole->truth(later).pad_pressure_pa[5] > 0);
  auto no_taxels = pressed(bench17_without({"taxels"}));
  CHECK(no_taxels->truth(later).contact_force_n == force_n);
  CHECK(std::isnan(no_taxels->truth(later).pad_pressure_pa[5]));
  auto stages_only = pressed(bench17_without({"taxels", "wrench"}));
  CHECK(std::isnan(stages_only->truth(later).contact_force_n));
  CHECK(stages_only->truth(later).fabric_point_m == whole->truth(later).fabric_point_m);
  CHECK(std::isnan(stages_only->truth(later).pad_pressure_pa[5]));
}

TEST_CASE("a sensor without noise reads its load to one quantum, one with noise does not") {
  const auto scatter = [](const char* scale) {
    auto rig = test::make_rig(bench17_with({{"/devices/5/emulator/noise_scale", scale}}), 1);
    test::TestLoop loop;
    test::TestLink ft(loop);
    REQUIRE(rig->attach("ft", ft, loop));
    ft.send(test::hex("12 34 00 02 00 00 00 00"));
    loop.run_for(1);
    std::vector<std::int32_t> seen;
    for (const Bytes& piece : ft.pieces)
      seen.push_back(protocols::rdt::decode_record(piece)->force_counts[2]);
    REQUIRE(seen.size() > 90);
    return *std::max_element(seen.begin(), seen.end()) -
           *std::min_element(seen.begin(), seen.end());
  };
  CHECK(scatter("0") == 0);
  CHECK(scatter("1") > 20'000);  // 20 mN
}

TEST_CASE("a choice is written into the rig file, so that it can be run again") {
  const std::string rig = bench17_with({{traits, "[]"}});
  const SimulationChoice choice = choice_of(rig, {{Trait::regulated_force}, {5, 5}});
  CHECK(to_string(choice.setting) == "L1 3.072 ms");
  for (const char* need : {"wrench", "taxel", "force"})
    CHECK(choice.because.find(need) != std::string::npos);
  CHECK(choice.because.find("relaxation") == std::string::npos);
  const json written = json::parse(choice.rig_json);
  CHECK(written["simulation"]["level"] == "L1");
  CHECK(written["simulation"]["chosen"]["because"] == choice.because);
  CHECK(written["devices"] == json::parse(rig)["devices"]);
  const SimulationChoice again = choice_of(choice.rig_json, {});
  CHECK(again.rig_json == choice.rig_json);
  CHECK(again.because == choice.because);
  CHECK(again.setting == choice.setting);
}

TEST_CASE("a chosen level L2 is recorded with its step and integrator, for versions to come") {
  const std::string rig = bench17_with({{traits, R"(["regulated_force", "stick_slip"])"}});
  const SimulationChoice choice = choice_of(rig, {{Trait::regulated_force}, {5}});
  REQUIRE(choice.setting.level == Level::dynamic);
  const json simulation = json::parse(choice.rig_json)["simulation"];
  CHECK(simulation["step_us"].get<double>() == Approx(choice.setting.step_s * 1e6));
  CHECK(simulation["dynamics"]["integrator"] == to_string(choice.setting.integrator));
  CHECK(choice_of(choice.rig_json, {}).setting == choice.setting);
}

TEST_CASE("a step alone means equal substeps") {
  const std::string rig = bench17_with({{level, R"("L2")"}, {"/simulation/step_us", "384"}});
  CHECK(to_string(choice_of(rig, {}).setting) == "L2 midpoint 0.384 ms");
}

TEST_CASE("a level by hand stays, and its file too") {
  const std::string rig = bench17_with({{level, R"("L2")"}});
  const SimulationChoice choice = choice_of(rig, {{Trait::regulated_force}, {5}});
  CHECK(choice.rig_json == rig);
  CHECK(choice.because == "the rig file names it");
  CHECK(to_string(choice.setting) == "L2 adaptive 0.192 ms");
  // an earlier choice is no explanation after the level was changed
  json edited = json::parse(choice_of(test::bench17_text(), {}).rig_json);
  edited["simulation"]["level"] = "L2";
  CHECK(choice_of(edited.dump(), {}).because == "the rig file names it");
}

TEST_CASE("level L0 is given the recipe's one force, and refused for several") {
  const std::string rig = bench17_with({{level, R"("L0")"}, {traits, "[]"}});
  const SimulationChoice choice = choice_of(rig, {{Trait::regulated_force}, {4, 4}});
  CHECK(choice.setting.level == Level::algebraic);
  CHECK(parse_rig_config(choice.rig_json)->bench_plant.plant.set_point_n == 4);
  const auto several = choose_simulation(rig, {{}, {4, 5}}, nullptr);
  REQUIRE_FALSE(several);
  CHECK(several.error().code == Errc::unsupported);
  CHECK(several.error().got.find("4 to 5 N") != std::string::npos);
  const std::string named =
      bench17_with({{level, R"("L0")"}, {traits, "[]"}, {"/simulation/set_point_n", "3"}});
  CHECK(parse_rig_config(choice_of(named, {{}, {4, 5}}).rig_json)->bench_plant.plant.set_point_n ==
        3);
}

TEST_CASE("an accuracy or a budget chooses from the table, and the rig file has the choice") {
  FidelityTable table = table_of({measured(l1, 20e-3, 25), measured(coarse_l2, 5e-3, 400)});
  table.host_cost.probe_us = 50;
  SimulationRequest request{{Trait::regulated_force}, {5}};
  request.fidelity.probe_us = 50;
  request.fabrics = {"denim"};
  request.seat_speed_mps = 0.5e-3;
  request.fidelity.accuracy_n = 10e-3;
  const SimulationChoice choice = choice_of(test::bench17_text(), request, &table);
  CHECK(choice.setting == coarse_l2);
  for (const char* part : {"wrench", "taxel", "relaxation", "force", "10 mN", "5 mN on denim"})
    CHECK(choice.because.find(part) != std::string::npos);
  SimulationRequest slower = request;  // the same on a machine that is busier now
  slower.fidelity.probe_us = 75;
  const SimulationChoice again = choice_of(test::bench17_text(), slower, &table);
  CHECK(again.offer->forecast.times_real_time() != choice.offer->forecast.times_real_time());
  CHECK(again.rig_json == choice.rig_json);
  REQUIRE(choice.offer);
  CHECK(choice.offer->promise_n == Approx(5e-3));
  CHECK_FALSE(choice.next);
  const auto config = parse_rig_config(choice.rig_json);
  REQUIRE(config);
  CHECK(to_string(setting_of(config->bench_plant.plant)) == "L2 tr_bdf2 1 ms");
  CHECK(choice_of(choice.rig_json, {}).because == choice.because);
  request.fidelity.accuracy_n = 30e-3;
  const SimulationChoice coarse = choice_of(test::bench17_text(), request, &table);
  CHECK(coarse.setting == l1);
  REQUIRE(coarse.next);
  CHECK(coarse.next->setting == coarse_l2);
  // a resumed campaign keeps the setting of its record
  SimulationRequest resumed = request;
  resumed.recorded = coarse_l2;
  resumed.recorded_because = choice.because;
  CHECK(choice_of(test::bench17_text(), resumed).rig_json == choice.rig_json);
  request.fidelity.accuracy_n = {};
  request.fidelity.times_real_time = 1e4;
  CHECK(choice_of(test::bench17_text(), request, &table).setting == l1);
  // a level set by hand is kept: then the request cannot be met
  CHECK_FALSE(choose_simulation(bench17_with({{level, R"("L2")"}}), request, &table));
  CHECK_FALSE(choose_simulation(test::bench17_text(), request, nullptr));
}

namespace {

/// A press and a slide of a plant with a recorded motion; the counts of every frame.
struct KeptRun {
  BenchMotion motion;
  std::vector<std::array<std::uint16_t, pad_count>> counts;
  std::vector<double> normal_n;
};

BenchPlantParams plant_params(const FidelitySetting& setting) {
  BenchPlantParams params;
  for (StageParams& stage : params.stages) stage = {.low = -1, .high = 1, .start = 0.05};
  params.stages[2].start = 0.057;
  params.stages[3].start = params.stages[4].start = 0;
  params.plant.geometry.plate_z_m = 0.06;
  apply(setting, params.plant);
  return params;
}

KeptRun press_and_slide(const FidelitySetting& setting) {
  BenchPlant bench_plant(plant_params(setting), 7);
  const TimePoint begin{std::chrono::milliseconds(123)};
  bench_plant.record_motion(true);
  bench_plant.mount(test::patch_of(test::library(), "jersey", 5), begin);
  KeptRun run;
  for (std::uint64_t frame = BenchPlant::frame_at_or_after(begin); frame < 400; ++frame) {
    const TimePoint t = BenchPlant::frame_start(frame);
    if (frame == 10) bench_plant.stage(AxisId::z, t).move_to(0.0598, {1e-3, 0.02}, t);
    if (frame == 250) bench_plant.stage(AxisId::y, t).move_to(0.06, {2e-3, 0.02}, t);
    const TimePoint end = BenchPlant::frame_start(frame + 1);
    run.counts.push_back(bench_plant.frame(end).counts);
    run.normal_n.push_back(bench_plant.plant().contact().normal_n);
  }
  auto motion = bench_plant.extract_motion();
  REQUIRE(motion);
  CHECK_FALSE(bench_plant.extract_motion());
  run.motion = std::move(*motion);
  return run;
}

}  // namespace

TEST_CASE("a replayed motion is the run itself, bit for bit, at every level") {
  for (const FidelitySetting& setting :
       {FidelitySetting{.level = Level::algebraic}, l1, coarse_l2}) {
    const KeptRun run = press_and_slide(setting);
    CAPTURE(to_string(setting));
    REQUIRE(run.normal_n.back() > 1);
    const Replayed again = replay(plant_params(setting).plant, 7, run.motion);
    // The patch was mounted within a frame, and the end of that frame comes first in the replay.
    const auto skip = static_cast<std::ptrdiff_t>(again.counts.size() - run.counts.size());
    REQUIRE(skip == 1);
    CHECK(std::equal(run.counts.begin(), run.counts.end(), again.counts.begin() + skip));
    CHECK(std::equal(run.normal_n.begin(), run.normal_n.end(), again.normal_n.begin() + skip));
    const RunError none = difference(again, again);
    CHECK(none.samples > 200);
    // the last frame that ended before a sample counts
    const RunError late = run_error(plant_params(setting).plant, 7, run.motion,
                                    {{BenchPlant::frame_start(390) + Duration(1'000'000),
                                      BenchPlant::frame_start(395), BenchPlant::frame_start(5)},
                                     {}});
    CHECK(late.samples == 2);  // there is no contact in the fifth frame
    CHECK(late.anywhere_max_n >= late.force_max_n);
    CHECK((late.worst_at == BenchPlant::frame_start(390) ||
           late.worst_at == BenchPlant::frame_start(395)));
    CHECK_FALSE(late.pads);
    CHECK((none.force_max_n == 0 && none.friction_max_n == 0 && none.counts_max == 0));
    CHECK(difference(again, replay(plant_params(setting).plant, 8, run.motion)).counts_max > 0);
  }
}

TEST_CASE("samples of the force sensor count beside those of the pads, at the grid point before") {
  const KeptRun run = press_and_slide(l1);
  const TimePoint frame = BenchPlant::frame_start(390);
  const Duration step(pad_timing::stage_ns);
  const auto points =
      wrench_points(run.motion, {frame - Duration(1), frame, frame + step, frame + 3 * step / 2,
                                 TimePoint{}, TimePoint{std::chrono::hours(1)}});
  REQUIRE(points.size() == 4);        // none before the first pose, none after the last
  CHECK(points[1] == points[0] + 1);  // the frame ends at its start
  CHECK(points[2] == points[1] + 1);
  CHECK(points[3] == points[2]);
  const PlantParams params = plant_params(l1).plant;
  const Replayed again = replay(params, 7, run.motion, points);
  REQUIRE(again.wrench_n.size() == 4);
  const std::size_t ended = 389 - run.motion.first.frame;
  CHECK(again.wrench_n[1] == again.normal_n[ended]);
  CHECK(again.wrench_n[2] == again.wrench_n[3]);
  Replayed off = again;
  off.wrench_n[2] += 0.5;
  const RunError error = difference(again, off, std::vector<bool>(again.normal_n.size(), false));
  CHECK(error.samples == 4);
  CHECK(error.force_max_n == Approx(0.5));
  off.wrench_n[2] = std::numeric_limits<double>::quiet_NaN();
  CHECK(difference(again, off).force_max_n == HUGE_VAL);
  // through the whole comparison, which reports the place of the worst error
  const RunError all = run_error(params, 7, run.motion, {{frame}, {frame + 2 * step}});
  CHECK(all.samples == 2);
  CHECK((all.worst_at == frame || all.worst_at == frame + 2 * step));
}

TEST_CASE("a run's error falls with its step, and L1's is that of its model") {
  const KeptRun run = press_and_slide(l1);
  const auto at = [&](const FidelitySetting& setting) {
    return run_error(plant_params(setting).plant, 7, run.motion);
  };
  const RunError quasistatic = at(l1);
  CHECK(quasistatic.reference == "L2 tr_bdf2 0.2 ms");
  CHECK(quasistatic.force_rms_n > 1e-5);
  CHECK(quasistatic.force_rms_n < 20e-3);
  // the loop's reaction to a fabric with another memory of its first contact
  CHECK(quasistatic.force_rms_n < quasistatic.unled_rms_n);
  FidelitySetting quarter = l1;
  quarter.step_s /= 4;
  CHECK(at(quarter).force_max_n > 0.5 * quasistatic.force_max_n);
  const RunError coarse = at({Level::dynamic, Integrator::midpoint, 1e-3});
  const RunError fine = at({Level::dynamic, Integrator::midpoint, 0.1e-3});
  CHECK(fine.force_rms_n < 0.3 * coarse.force_rms_n);
  const RunError algebraic = at({.level = Level::algebraic});
  CHECK(algebraic.reference == "L2 tr_bdf2 0.2 ms");
  CHECK(algebraic.force_max_n > 0.5);  // the set point at once
}

TEST_CASE("a force that is no number is infinitely far from any, and is counted") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Replayed good{{0, 1, 2}, {}, std::vector<Vector2>(3, Vector2{0, 0})};
  for (const std::size_t where : {0, 2})  // without contact, and with it
    for (const double wrong : {nan, std::numeric_limits<double>::infinity()}) {
      Replayed bad = good;
      bad.normal_n[where] = wrong;
      for (const RunError& error :
           {difference(good, bad), difference(bad, good), difference(bad, bad)}) {
        CHECK(error.force_max_n == HUGE_VAL);
        CHECK(error.anywhere_max_n == HUGE_VAL);
        CHECK(error.force_rms_n == HUGE_VAL);
        CHECK(error.samples == (where == 0 ? 3 : 2));
      }
    }
  CHECK(difference(good, good).force_max_n == 0);
}

TEST_CASE("an accuracy is held against two references that agree, or the error is unresolved") {
  const KeptRun run = press_and_slide(l1);
  const auto against = [&](double accuracy_n) {
    return run_error(plant_params({Level::dynamic, Integrator::midpoint, 1e-3}).plant, 7,
                     run.motion, {}, accuracy_n);
  };
  const RunError loose = against(1);
  CHECK(loose.is_doubled);
  CHECK(loose.is_resolved);
  CHECK(loose.reference == "L2 tr_bdf2 0.05 ms");
  CHECK(loose.uncertainty_n > 0);
  CHECK(loose.uncertainty_n < trusted_share);
  const RunError again = against(1);
  CHECK(again.force_max_n == loose.force_max_n);
  CHECK(again.uncertainty_n == loose.uncertainty_n);
  // far below the error: no finer reference could change the verdict
  const RunError hopeless = against(1e-3 * loose.uncertainty_n);
  CHECK(hopeless.is_resolved);
  CHECK(hopeless.reference == loose.reference);
  CHECK(hopeless.force_max_n > 1e-3 * loose.uncertainty_n);
}

TEST_CASE("the place of an error is that against the reference which is further") {
  const FidelitySetting setting{Level::dynamic, Integrator::midpoint, 1e-3};
  const PlantParams params = plant_params(setting).plant;
  const BenchMotion motion = press_and_slide(l1).motion;
  const Replayed run = replay(params, 7, motion);
  const auto errors_by = [&](const Reference& reference) {
    PlantParams finer = params;
    apply(reference.setting(), finer);
    finer.watched.pads = false;
    const Replayed led = replay_led(finer, 7, motion, run);
    std::vector<double> out;
    for (std::size_t i = 0; i < led.normal_n.size(); ++i)
      out.push_back(led.normal_n[i] > 0 ? std::abs(run.normal_n[i] - led.normal_n[i]) : 0);
    return out;
  };
  const Reference first = first_reference(setting);
  const std::vector<double> one = errors_by(first), other = errors_by(second_reference(first));
  const auto sampled = [&](std::size_t frame) {
    return BenchPlant::frame_start(motion.first.frame + frame + 1);
  };
  std::size_t found = 0;  // pairs of frames that the two references rank differently
  for (std::size_t i = 0; i < one.size() && found == 0; ++i)
    for (std::size_t j = 0; j < one.size() && found == 0; ++j) {
      if (!(one[i] > one[j] && other[j] > other[i] && other[j] > one[i])) continue;
      ++found;
      const RunError error = run_error(params, 7, motion, {{sampled(i), sampled(j)}, {}}, 1.0);
      CHECK(error.force_max_n == other[j]);
      CHECK(error.worst_at == sampled(j));
    }
  CHECK(found == 1);
}

}  // namespace level_test
