// The choice of level, integrator and step from a measured table: a table made up for the test.

#include <catch2/catch.hpp>

#include "sim/plant/fidelity/table.hpp"

namespace fidelity_test {

using namespace weft;
using namespace weft::sim;

namespace {

const Scene tactile{
    "tactile", {Channel::stages, Channel::wrench, Channel::taxels}, {Trait::regulated_force}};
const Scene slipping{"slipping", {Channel::wrench}, {Trait::stick_slip}};

void add(FidelityTable& table, const FidelitySetting& setting, double error_n, double speed,
         bool on_stick_slip = true) {
  for (const char* scene : {"press", "slide", "fabrics17", "retouch"})
    table.rows.push_back({scene, setting, error_n, error_n / 4, speed});
  if (on_stick_slip) table.rows.push_back({"stick_slip", setting, 3 * error_n, 0, speed / 2});
}

FidelitySetting l2(Integrator integrator, double step_ms) {
  return {Level::dynamic, integrator, step_ms * 1e-3};
}

FidelityTable small_table() {
  FidelityTable table;
  add(table, {.level = Level::algebraic}, 2, 300'000);
  add(table, {Level::quasistatic, Integrator::midpoint, grid_step_s}, 20e-3, 40'000, false);
  add(table, {Level::quasistatic, Integrator::midpoint, 27e-3}, 21e-3, 200'000, false);
  add(table, l2(Integrator::midpoint, 1), 8e-3, 4'000);
  add(table, l2(Integrator::tr_bdf2, 1), 9e-3, 3'000);
  add(table, l2(Integrator::midpoint, 0.2), 0.4e-3, 1'200);
  add(table, l2(Integrator::midpoint, 0.05), 0.02e-3, 300);
  return table;
}

FidelitySetting chosen(const Scene& scene, const FidelityRequest& request) {
  const auto offer = choose(small_table(), scene, request);
  if (!offer) FAIL(to_string(offer.error()));
  return offer->setting;
}

std::string sentence(const Scene& scene, const FidelityRequest& request) {
  const auto offer = choose(small_table(), scene, request);
  REQUIRE_FALSE(offer);
  CHECK(offer.error().code == Errc::unsupported);
  return to_string(offer.error());
}

}  // namespace

TEST_CASE("an accuracy selects the fastest setting that keeps it, on the worst of its scenes") {
  CHECK(chosen(tactile, {.accuracy_n = 20e-3}) ==
        FidelitySetting{Level::quasistatic, Integrator::midpoint, grid_step_s});
  CHECK(chosen(tactile, {.accuracy_n = 21e-3}).step_s == 27e-3);
  CHECK(chosen(tactile, {.accuracy_n = 19.9e-3}) == l2(Integrator::midpoint, 1));
  CHECK(chosen(tactile, {.accuracy_n = 1e-3}) == l2(Integrator::midpoint, 0.2));
  // three times the error where the probe sticks and slips
  CHECK(chosen(slipping, {.accuracy_n = 19.9e-3}) == l2(Integrator::midpoint, 0.2));
}

TEST_CASE("a level that cannot produce the scene is no offer however fast and accurate") {
  const auto levels = [](const Scene& scene) {
    std::vector<Level> out;
    for (const FidelityOffer& offer : offers(small_table(), scene))
      out.push_back(offer.setting.level);
    return out;
  };
  const auto tactile_levels = levels(tactile), slipping_levels = levels(slipping);
  CHECK(tactile_levels.size() == 6);  // without L0
  CHECK(tactile_levels.front() == Level::quasistatic);
  CHECK(slipping_levels == std::vector<Level>(4, Level::dynamic));
  CHECK(levels({"sound", {Channel::microphone}, {}}).empty());
  CHECK(chosen({"means", {Channel::taxels}, {Trait::mean_level}}, {.times_real_time = 250'000})
            .level == Level::algebraic);
}

TEST_CASE("a setting that is not measured on every scene is no offer") {
  FidelityTable table = small_table();
  std::erase_if(table.rows, [](const FidelityRow& row) {
    return row.scene == "slide" && row.setting == l2(Integrator::midpoint, 0.05);
  });
  CHECK(offers(table, tactile).size() == offers(small_table(), tactile).size() - 1);
  CHECK(offers({}, tactile).empty());
}

TEST_CASE("a speed selects the most accurate setting that reaches it, both the fastest of both") {
  CHECK(chosen(tactile, {.times_real_time = 1'000}) == l2(Integrator::midpoint, 0.2));
  CHECK(chosen(tactile, {.times_real_time = 5'000}).step_s == grid_step_s);
  CHECK(chosen(tactile, {.times_real_time = 50'000}).step_s == 27e-3);
  CHECK(chosen(slipping, {.times_real_time = 1'000}) == l2(Integrator::midpoint, 1));
  CHECK(chosen(tactile, {.accuracy_n = 10e-3, .times_real_time = 1'000}) ==
        l2(Integrator::midpoint, 1));
  CHECK(chosen(tactile, {.accuracy_n = 0.1, .level = Level::dynamic}) ==
        l2(Integrator::midpoint, 1));
}

TEST_CASE("what no setting does is refused with the nearest offers") {
  const std::string accuracy = sentence(tactile, {.accuracy_n = 1e-6});
  CHECK(accuracy.find("at most 0.001 mN") != std::string::npos);
  CHECK(accuracy.find("L2 midpoint 0.05 ms (0.02 mN, 300 times real time)") != std::string::npos);
  const std::string speed = sentence(tactile, {.times_real_time = 1e6});
  CHECK(speed.find("L1 27 ms (21 mN, 2e+05 times real time)") != std::string::npos);
  const std::string both = sentence(tactile, {.accuracy_n = 1e-3, .times_real_time = 3'500});
  CHECK(both.find("L2 midpoint 1 ms") != std::string::npos);
  CHECK(both.find("L2 midpoint 0.2 ms") != std::string::npos);
  CHECK(sentence({"sound", {Channel::microphone}, {}}, {.accuracy_n = 1}).find("none") !=
        std::string::npos);
  CHECK(sentence(tactile, {.accuracy_n = 1e-3, .level = Level::quasistatic}).find("at level L1") !=
        std::string::npos);
}

TEST_CASE("the order of the table's rows is nothing to the choice") {
  FidelityTable backwards = small_table();
  add(backwards, l2(Integrator::tr_bdf2, 0.5), 8e-3, 4'000);  // as good as midpoint at 1 ms
  FidelityTable forwards = backwards;
  std::reverse(backwards.rows.begin(), backwards.rows.end());
  for (const FidelityRequest request :
       {FidelityRequest{.accuracy_n = 10e-3}, {.times_real_time = 4'000}})
    CHECK(choose(forwards, tactile, request)->setting ==
          choose(backwards, tactile, request)->setting);
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
  const auto with_row = [](const std::string& row) {
    return R"({"schema_version": 1, "bench": "simulated", "made_by": "weft trade sim", "machine": "m",
      "commit": "c", "rows": [)" +
           row + "]}";
  };
  const std::string fine =
      R"({"scene": "press", "level": "L2", "integrator": "tr_bdf2", "step_us": 1000,
          "error_max_n": 0.002, "error_rms_n": 0.001, "times_real_time": 3000})";
  const auto table = parse_fidelity(with_row(fine));
  REQUIRE(table);
  CHECK(table->machine == "m");
  REQUIRE(table->rows.size() == 1);
  CHECK(table->rows[0].setting == l2(Integrator::tr_bdf2, 1));
  CHECK(table->rows[0].times_real_time == 3000);
  const auto refused_at = [&](const std::string& from, const std::string& to) {
    std::string row = fine;
    row.replace(row.find(from), from.size(), to);
    const auto read = parse_fidelity(with_row(row));
    REQUIRE_FALSE(read);
    return read.error().where;
  };
  CHECK(refused_at("\"press\"", "\"pull\"") == "/rows/0/scene");
  CHECK(refused_at("L2", "Z") == "/rows/0/level");
  CHECK(refused_at("tr_bdf2", "rk4").find("/rows/0/integrator") != std::string::npos);
  CHECK(refused_at("0.002", "-1") == "/rows/0/error_max_n");
  CHECK(refused_at("3000", "1e999") == "fidelity table: /rows/0");  // too large for any double
  CHECK(refused_at("\"scene\"", "\"level\": 1, \"scene\"") == "fidelity table: /rows/0/level");
  CHECK(refused_at("error_rms_n", "error_rms") != "");
  CHECK_FALSE(parse_fidelity(R"({"schema_version": 1, "bench": "real", "rows": []})"));
  CHECK_FALSE(parse_fidelity(R"({"schema_version": 2, "bench": "simulated", "rows": []})"));
  CHECK_FALSE(parse_fidelity("[]"));
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
