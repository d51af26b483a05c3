// The choice of level, integrator and step from a measured table, made up for the test.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "sim/plant/fidelity/choose.hpp"

namespace fidelity_test {

using namespace weft;
using namespace weft::sim;

namespace {

const Scene tactile{
    "tactile", {Channel::stages, Channel::wrench, Channel::taxels}, {Trait::regulated_force}};
const Scene slipping{"slipping", {Channel::wrench}, {Trait::stick_slip}};

FidelitySetting l1(double step_s = grid_step_s) {
  return {Level::quasistatic, Integrator::midpoint, step_s};
}

FidelitySetting l2(Integrator integrator, double step_ms) {
  return {Level::dynamic, integrator, step_ms * 1e-3};
}

/// Errors of denim; those of nylon are three times as large.
MeasuredSetting measured(const FidelitySetting& setting, double error_n, double contact_us) {
  return {.setting = setting,
          .contact_us_per_s = contact_us,
          .cloths = {{"denim", 10, error_n / 4, error_n / 2, error_n},
                     {"nylon", 10, error_n, 2 * error_n, 3 * error_n}},
          .margin = {2, 0.995},
          .any_q99 = error_n / 2,
          .any_max = error_n,
          .any_margin = {3, 0.991}};
}

FidelityTable small_table() {
  FidelityTable table;
  table.conditions.force_n = {0.2, 10};
  table.conditions.speed_mps = {0.5e-3, 4e-3};
  table.conditions.seat_speed_mps = {0.2e-3, 1e-3};
  table.conditions.press_s = {1, 10};
  table.conditions.mount_stiffness_n_m = {1e4, 5e4};
  table.conditions.slack_m = {0.6e-3, 3e-3};
  table.host_cost = {.pads_us_per_s = 30,
                     .emulators_us_per_s = 400,
                     .drivers_us_per_s = 200,
                     .recorder_us_per_s = 100,
                     .export_us_per_trial = 500,
                     .evaluate_us_per_trial = 1000,
                     .quick_check_us_per_s = 2000,
                     .full_check_us_per_s = 20'000,
                     .probe_us = 50};
  table.settings = {measured({.level = Level::algebraic}, 1, 3),
                    measured(l1(), 10e-3, 25),
                    measured(l1(27e-3), 10.5e-3, 5),
                    measured(l2(Integrator::midpoint, 1), 4e-3, 250),
                    measured(l2(Integrator::tr_bdf2, 1), 4.5e-3, 333),
                    measured(l2(Integrator::midpoint, 0.2), 0.2e-3, 833),
                    measured(l2(Integrator::midpoint, 0.05), 0.01e-3, 3333)};
  return table;
}

ForceScene on(const std::vector<std::string>& fabrics) {
  ForceScene out;
  out.fabrics = fabrics;
  out.force_n = {5, 5};
  out.speed_mps = {2e-3, 2e-3};
  out.seat_speed_mps = 0.5e-3;
  out.face_area_m2 = 256e-6;
  out.mount.slack_m = 1e-3;
  return out;
}

FidelityRequest accuracy(double accuracy_n) {
  return {.accuracy_n = accuracy_n};
}

FidelityRequest budget(double times) {
  return {.times_real_time = times};
}

FidelitySetting chosen(const FidelityRequest& request, const Scene& scene = tactile,
                       const ForceScene& forces = on({"denim"})) {
  const auto offer = choose(small_table(), scene, forces, request);
  if (!offer) FAIL(to_string(offer.error()));
  return offer->setting;
}

Error refusal(const FidelityRequest& request, const ForceScene& forces = on({"denim"})) {
  const auto offer = choose(small_table(), tactile, forces, request);
  REQUIRE_FALSE(offer);
  return offer.error();
}

}  // namespace

TEST_CASE("an accuracy selects the fastest setting that promises it") {
  CHECK(chosen(accuracy(20e-3)) == l1());  // twice the largest error
  CHECK(chosen(accuracy(21e-3)) == l1(27e-3));
  CHECK(chosen(accuracy(19.9e-3)) == l2(Integrator::midpoint, 1));
  CHECK(chosen(accuracy(1e-3)) == l2(Integrator::midpoint, 0.2));
  CHECK(chosen(accuracy(25e-3), slipping) == l2(Integrator::midpoint, 1));
}

TEST_CASE("a promise is that of the worst of the plan's cloths, and of no other") {
  const auto offer = choose(small_table(), tactile, on({"denim", "nylon"}), accuracy(25e-3));
  REQUIRE(offer);
  CHECK(offer->setting == l2(Integrator::midpoint, 1));
  CHECK(offer->promise_n == Approx(2 * 3 * 4e-3));
  CHECK(offer->limiting_fabric == "nylon");
  CHECK(chosen(accuracy(25e-3)) == l1(27e-3));
}

TEST_CASE("a fabric without a row is promised by its impact, or refused if unknown") {
  FabricLibrary library;
  Fabric cloth;
  cloth.name = "new";
  cloth.kes = {.linearity = 0.35, .work_j_m2 = 0.2, .resilience = 0.5};
  library.fabrics.push_back(cloth);
  ForceScene forces = on({"denim", "new"});
  CHECK(refusal(accuracy(1), forces).code == Errc::not_found);
  forces.library = &library;
  const auto law = law_from_kes(cloth.kes);
  REQUIRE(law);
  const double scale_n = impact_scale_n(*law, forces.mount, 0.5e-3, 5, forces.face_area_m2);
  const double stiffness_n_m = (5 + 256e-6 * law->pressure_pa) / law->lambda_m;
  CHECK(scale_n == Approx(0.5e-3 * std::sqrt(stiffness_n_m * 0.2)));
  const auto all = offers(small_table(), tactile, forces, {});
  REQUIRE(all);
  for (const FidelityOffer& offer : *all)
    if (offer.setting == l1())
      CHECK(offer.promise_n == Approx(std::max(2 * 10e-3, 3 * 10e-3 * scale_n)));
  // the table has no row for another fabric table
  library.fabrics.back().name = "denim";
  forces.fabrics = {"denim"};
  forces.has_rows = false;
  const auto rowless = offers(small_table(), tactile, forces, {});
  REQUIRE(rowless);
  for (const FidelityOffer& offer : *rowless)
    if (offer.setting == l1()) CHECK(offer.promise_n == Approx(3 * 10e-3 * scale_n));
}

TEST_CASE("forces, speeds and slack that the table was not measured for are refused") {
  const auto is_refused = [](const std::function<void(ForceScene&)>& change) {
    ForceScene forces = on({"denim"});
    change(forces);
    return refusal(accuracy(1), forces).code == Errc::unsupported;
  };
  CHECK(is_refused([](ForceScene& f) { f.force_n.most = 10.5; }));
  CHECK(is_refused([](ForceScene& f) { f.force_n.least = 0.1; }));
  CHECK(is_refused([](ForceScene& f) { f.speed_mps.most = 5e-3; }));
  CHECK(is_refused([](ForceScene& f) { f.seat_speed_mps = 2e-3; }));
  CHECK(is_refused([](ForceScene& f) { f.mount.slack_m = 0.5e-3; }));
  CHECK(is_refused([](ForceScene& f) { f.mount.stiffness_n_m = 1e5; }));
  CHECK(is_refused([](ForceScene& f) { f.press_s = {0.5, 2}; }));
  CHECK(is_refused([](ForceScene& f) { f.press_s = {2, 20}; }));
  ForceScene pressed = on({"denim"});
  pressed.speed_mps = {};  // without sliding
  CHECK(choose(small_table(), tactile, pressed, accuracy(1)));
}

TEST_CASE("a level that cannot produce the scene is no offer however fast and accurate") {
  const auto levels = [](const Scene& scene) {
    std::vector<Level> out;
    const auto all = offers(small_table(), scene, on({"denim"}), {});
    REQUIRE(all);
    for (const FidelityOffer& offer : *all) out.push_back(offer.setting.level);
    return out;
  };
  CHECK(levels(tactile).size() == 6);  // without L0
  CHECK(levels(tactile).front() == Level::quasistatic);
  CHECK(levels(slipping) == std::vector<Level>(4, Level::dynamic));
  CHECK(levels({"sound", {Channel::microphone}, {}}).empty());
}

TEST_CASE("a forecast is the sum of its parts, scaled by the machine's speed") {
  const FidelityTable table = small_table();
  const RunSize run{.bench_s = 1000, .trials = 20, .checked_s = 100};
  const SpeedForecast here = forecast(table.host_cost, table.settings[1], run, 0);
  CHECK(here.plant_s == Approx(1000 * (25 + 30) * 1e-6));
  CHECK(here.emulators_s == Approx(0.4));
  CHECK(here.drivers_s == Approx(0.2));
  CHECK(here.recorder_s == Approx(0.1));
  CHECK(here.error_check_s == Approx(0.2));
  CHECK(here.export_s == Approx(0.01));
  CHECK(here.evaluate_s == Approx(0.02));
  CHECK(here.times_real_time() == Approx(1000 / here.total_s()));
  CHECK(here.campaign_times_real_time() > here.times_real_time());
  const SpeedForecast slow = forecast(table.host_cost, table.settings[1], run, 100);
  CHECK(slow.total_s() == Approx(2 * here.total_s()));
  RunSize fully = run;
  fully.is_fully_checked = true;
  fully.has_pads = fully.is_evaluated = false;
  const SpeedForecast other = forecast(table.host_cost, table.settings[1], fully, 0);
  CHECK(other.error_check_s == Approx(2));
  CHECK(other.plant_s == Approx(0.025));
  CHECK(other.evaluate_s == 0);
}

TEST_CASE("a budget takes the most accurate setting with a fast enough forecast of the whole run") {
  // 730 us of a bench second do not belong to the contact
  CHECK(chosen(budget(500)) == l2(Integrator::midpoint, 0.2));
  CHECK(chosen(budget(900)) == l2(Integrator::midpoint, 1));
  CHECK(chosen(budget(1150)) == l1());
  const double reach = 1e6 / (730 + 25);
  CHECK(chosen(budget(reach / forecast_reserve * 0.999)) == l1());
  CHECK(chosen(budget(reach / forecast_reserve * 1.001)) == l1(27e-3));
}

TEST_CASE("a budget that no run reaches is refused with the fastest figure and its parts") {
  const Error error = refusal(budget(100'000));
  CHECK(error.code == Errc::unsupported);
  CHECK(error.got.find("1361x (L1 27 ms)") != std::string::npos);  // 1e6/735
  CHECK(error.got.find("emulators 54 %") != std::string::npos);
  FidelityRequest slow = budget(500);
  slow.probe_us = 5000;
  CHECK(refusal(slow).got.find("13.6x") != std::string::npos);
}

TEST_CASE("an accuracy that no setting promises is refused with the nearest") {
  const Error error = refusal(accuracy(1e-6));
  CHECK(error.code == Errc::unsupported);
  CHECK(error.expected.find("0.001 mN") != std::string::npos);
  CHECK(error.got.find("L2 midpoint 0.05 ms (promises 0.02 mN") != std::string::npos);
  FidelityRequest l1_only = accuracy(1e-3);
  l1_only.level = Level::quasistatic;
  CHECK(refusal(l1_only).expected.find("L1") != std::string::npos);
  FidelityRequest both = accuracy(1e-3);
  both.times_real_time = 900;
  CHECK(refusal(both).code == Errc::unsupported);
}

TEST_CASE("after a miss the next setting promises less") {
  FidelityRequest after = accuracy(25e-3);
  after.promise_below_n = 2 * 10e-3;  // the promise of L1
  CHECK(chosen(after) == l2(Integrator::midpoint, 1));
  after.promise_below_n = 2 * 0.01e-3;
  CHECK(refusal(after).code == Errc::unsupported);
}

TEST_CASE("the order of the table's rows is nothing to the choice") {
  FidelityTable backwards = small_table();
  // as good as midpoint at 1 ms
  backwards.settings.push_back(measured(l2(Integrator::tr_bdf2, 0.5), 4e-3, 250));
  FidelityTable forwards = backwards;
  std::reverse(backwards.settings.begin(), backwards.settings.end());
  for (const FidelityRequest& request : {accuracy(10e-3), budget(900)})
    CHECK(choose(forwards, tactile, on({"denim"}), request)->setting ==
          choose(backwards, tactile, on({"denim"}), request)->setting);
}

TEST_CASE("accuracies and budgets are read with their units and nothing else") {
  CHECK(*parse_accuracy_n("10mN") == Approx(0.01));
  CHECK(*parse_accuracy_n("0.01 N") == Approx(0.01));
  CHECK(*parse_accuracy_n("0.5%") == Approx(0.025));
  CHECK(*parse_times_real_time("1000x") == 1000);
  for (const char* text :
       {"", "10", "mN", "-1mN", "0N", "nanN", "infN", "1e9N", "10mNN", "1e-400N"})
    CHECK_FALSE(parse_accuracy_n(text));
  for (const char* text : {"", "1000", "x", "0x", "-5x", "infx", "1000 times", "1e99x"})
    CHECK_FALSE(parse_times_real_time(text));
}

TEST_CASE("the table reads back from JSON, and faults are refused with their place") {
  FidelityTable made = small_table();
  made.machine = "m";
  made.rules = 2;
  made.conditions.scenes = 600;
  made.conditions.trials = 2990;
  made.settings[1].margin = {1.5, 0.999};
  made.conditions.seeds = 5;
  const std::string text = to_json(made);
  const auto table = parse_fidelity(text);
  if (!table) FAIL(to_string(table.error()));
  CHECK(to_json(*table) == text);
  CHECK(table->machine == "m");
  CHECK(table->conditions.scenes == 600);
  CHECK(table->conditions.trials == 2990);
  CHECK(table->settings[1].margin.factor == 1.5);
  CHECK(table->settings[1].margin.held_share == 0.999);
  CHECK(table->settings[2].margin.factor == 2);
  CHECK(table->settings[2].any_margin.factor == 3);
  CHECK(table->settings[2].any_margin.held_share == 0.991);
  CHECK(table->conditions.slack_m.most == Approx(3e-3));
  CHECK(table->settings[4].setting.integrator == Integrator::tr_bdf2);
  CHECK(table->settings[1].cloths[1].max_n == Approx(30e-3));
  CHECK(table->host_cost.probe_us == 50);
  const auto refused_at = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json root = nlohmann::json::parse(text);
    root[nlohmann::json::json_pointer(pointer)] = value;
    const auto read = parse_fidelity(root.dump());
    REQUIRE_FALSE(read);
    return read.error();
  };
  CHECK(refused_at("/settings/0/level", "Z").where == "/settings/0/level");
  CHECK(refused_at("/settings/4/integrator", "rk4").where.find("/settings/4/integrator") !=
        std::string::npos);
  CHECK(refused_at("/settings/1/cloths/0/max_n", -1).where == "/settings/1/cloths/0/max_n");
  CHECK(refused_at("/settings/1/any", 3).where == "/settings/1/any");
  CHECK(refused_at("/host_cost/probe_us", "fast").where == "/host_cost/probe_us");
  CHECK(refused_at("/conditions/ranges/slack_m", 3).where == "/conditions/ranges/slack_m");
  CHECK(refused_at("/settings/0/margin", 0.5).where == "/settings/0/margin");
  CHECK(refused_at("/settings/0/held_share", 1.5).where == "/settings/0/held_share");
  for (const char* pointer : {"/settings/2/held_share", "/settings/0/any/held_share"})
    for (const double held_share : {0.0, 0.989}) {
      const Error unheld = refused_at(pointer, held_share);
      CHECK(unheld.code == Errc::unsupported);
      CHECK(unheld.where == pointer);
    }
  for (const char* place : {"/settings/1", "/settings/1/any"})
    for (const char* key : {"margin", "held_share"}) {
      nlohmann::json root = nlohmann::json::parse(text);
      root[nlohmann::json::json_pointer(place)].erase(key);
      const auto read = parse_fidelity(root.dump());
      REQUIRE_FALSE(read);
      CHECK(read.error().code == Errc::parse);
    }
  CHECK(refused_at("/settings", "none").where == "/settings");
  CHECK(refused_at("/rows", 1).code == Errc::parse);
  CHECK(refused_at("/bench", "real").where == "/bench");
  CHECK_FALSE(parse_fidelity("[]"));
}

TEST_CASE("a table of the first version is refused with the command that makes a new one") {
  const auto old = parse_fidelity(R"({"schema_version": 1, "bench": "simulated", "rows": []})");
  REQUIRE_FALSE(old);
  CHECK(old.error().code == Errc::unsupported);
  CHECK(old.error().hint.find("weft trade sim --table") != std::string::npos);
}

TEST_CASE("a machine's speed is the best of several rounds on its clock") {
  double now_us = 0;
  int reads = 0;
  const double probe = measure_probe_us([&] {
    // rounds of 100, 90, 80 ... us
    if (reads++ % 2 == 1) now_us += 100 - 5 * (reads - 2);
    return now_us;
  });
  CHECK(probe > 0);
  CHECK(probe < 2);  // 50 work items a round
}

TEST_CASE("a setting's name, and that it goes into a plant and back") {
  PlantParams params;
  CHECK(to_string(setting_of(params)) == "L1 3.072 ms");
  for (const FidelitySetting& setting :
       {l2(Integrator::tr_bdf2, 0.1), {.level = Level::algebraic}}) {
    apply(setting, params);
    CHECK(setting_of(params) == setting);
  }
}

}  // namespace fidelity_test
