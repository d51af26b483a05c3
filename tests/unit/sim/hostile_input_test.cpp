// Impossible files and loads: refused with the field's name, or simulated with finite numbers.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "sim/devices/ft_sensor.hpp"
#include "tests/unit/hostile_json.hpp"
#include "tests/unit/sim/support.hpp"

namespace hostile_input_test {

using namespace weft;
using namespace weft::sim;

namespace {

/// bench17 with every number of `simulation`, with the probe in contact from the start.
std::string rig_in_contact(const std::string& level) {
  return test::bench17_with(
      {{"/simulation/level", '"' + level + '"'},
       {"/simulation/step_us", "500"},
       {"/simulation/set_point_n", "5"},
       {"/simulation/dynamics",
        R"({"integrator": "midpoint", "normal_damping": 0.05, "lateral_stiffness_n_m": 1e5,
            "lateral_damping": 0.05, "static_ratio": 1.2, "stribeck_speed_mm_s": 5,
            "friction_speed_mm_s": 1, "bristle_damping": 0.3, "viscous_n_s_m": 0})"},
       {"/plate/tilt_axis_y_mm", "75"},
       {"/probe/tilt_arm_mm", "100"},
       {"/devices/2/emulator/start_mm", "59.9"},
       {"/devices/2/emulator/quantum_um", "1"},
       {"/devices/2/emulator/backlash_um", "1"},
       {"/devices/3/emulator/start_deg", "0"},
       {"/devices/4/emulator/start_deg", "0"},
       {"/devices/5/emulator/records_per_datagram", "10"},
       {"/devices/5/emulator/height_mm", "20"},
       {"/devices/5/emulator/noise_scale", "1"},
       {"/devices/5/emulator/rate_hz", "100"}});
}

/// The table with a fabric of the papers and a calibrated one, with their parameters, and two
/// fields of each list of the calibration: all others are similar.
std::string two_fabrics() {
  auto table = nlohmann::json::parse(test::fabrics_text());
  table["fabrics"] = {table["fabrics"][12], table["fabrics"][17]};
  auto structures = nlohmann::json::object();
  for (const auto& fabric : table["fabrics"]) {
    const std::string name = fabric["structure"];
    structures[name] = table["structures"].at(name);
  }
  table["structures"] = structures;
  for (auto& calibration : table["calibrations"])
    for (auto& list : calibration)
      if (list.is_array() && list.size() > 2) list = {list[0], list[1]};
  return table.dump();
}

/// Presses, drags along y and lifts for a sixth of a second; true if every number is finite.
bool runs_with_finite_numbers(std::unique_ptr<Rig> made, const std::string& fabric) {
  test::TestLoop loop;
  test::TestLink y(loop), z(loop), ft(loop), taxels(loop);
  const std::unique_ptr<Rig> rig = std::move(made);  // destroyed before its links
  for (auto& [name, link] :
       {std::pair{"stage.y", &y}, {"stage.z", &z}, {"ft", &ft}, {"taxels", &taxels}})
    if (!rig->attach(name, *link, loop)) return false;
  if (const auto mounted = rig->mount(fabric, 2, loop.now()); !mounted)
    return !mounted.error().what.empty();  // a fabric that cannot be cut is refused too
  for (test::TestLink* stage : {&y, &z}) stage->send(test::hex("10 02 01 01 50 01"));
  ft.send(test::hex("12 34 00 02 00 00 00 00"));
  y.send(test::hex("57 04 01 01 50 01"));  // towards its limit
  bool finite = true;
  for (int i = 0; i < 8; ++i) {
    if (i == 4) z.send(test::hex("57 04 01 02 50 01"));
    loop.run_for(0.02);
    const Truth truth = rig->truth(loop.now());
    for (const double x : {truth.contact_force_n, truth.indentation_m, truth.probe_z_m,
                           truth.fabric_point_m[1], truth.friction_n[0], truth.friction_n[1]})
      finite = finite && std::isfinite(x);
    for (const double pressure : truth.pad_pressure_pa) finite = finite && std::isfinite(pressure);
    finite = finite && truth.contact_force_n >= 0;
  }
  return finite && !taxels.received.empty();
}

}  // namespace

TEST_CASE("any number of a rig file that is absurd is refused by name, or simulated") {
  const std::string fabrics = test::fabrics_text();
  for (const char* level : {"L1", "L2"}) {
    const std::string base = rig_in_contact(level);
    REQUIRE(runs_with_finite_numbers(test::make_rig(base, 1), "terry"));
    int refused = 0, run = 0;
    for (const char* root : {"/devices", "/probe", "/plate", "/simulation"})
      hostile::for_each_number(
          base, root, [&](const std::string& pointer, auto value, const std::string& document) {
            const bool others = pointer.find("/config/") != std::string::npos;
            if (others) return;  // belongs to a driver: tests/unit/drivers
            CAPTURE(level, pointer, value);
            auto rig = Rig::create(document, fabrics, 1);
            if (!rig) {
              ++refused;
              const bool is_json = value.find("999") == std::string_view::npos;
              if (is_json) CHECK(hostile::names_field(rig.error().where, pointer));
              CHECK_FALSE(to_string(rig.error()).empty());
            } else {
              ++run;
              CHECK(runs_with_finite_numbers(std::move(*rig), "terry"));
            }
          });
    CHECK(refused > 300);
    CHECK(run > 50);
  }
}

TEST_CASE("any number of the fabric table that is absurd is refused by name, or simulated") {
  const std::string base = rig_in_contact("L1");
  const std::string text = two_fabrics();
  int refused = 0, run = 0;
  hostile::for_each_number(
      text, "", [&](const std::string& pointer, auto value, const std::string& document) {
        const std::string row = "/fabrics/";
        const std::size_t index =
            pointer.starts_with(row) ? std::stoul(pointer.substr(row.size())) : 0;
        CAPTURE(pointer, value);
        auto rig = Rig::create(base, document, 1);
        if (!rig) {
          ++refused;
          const bool is_json = value.find("999") == std::string_view::npos;
          if (is_json) CHECK(hostile::names_field(rig.error().where, pointer));
          return;
        }
        ++run;
        const std::string fabric = (*rig)->fabrics()[index];
        CHECK(runs_with_finite_numbers(std::move(*rig), fabric));
      });
  CHECK(refused > 500);
  CHECK(run > 30);
}

TEST_CASE("a load that is no load is held to the sensor's range and flagged, never a stray count") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  FtSensor sensor({}, 1);
  const auto held = [&](const FtReading& reading) {
    const FtSensorParams params;
    for (std::size_t i = 0; i < 6; ++i) {
      const double most =
          2 * params.range[i] * (i < 3 ? params.counts_per_n : params.counts_per_nm);
      if (std::abs(static_cast<double>(reading.counts[i])) > most) return false;
    }
    return true;
  };
  for (const double bad : {nan, inf, -inf, 1e308, -1e308}) {
    CAPTURE(bad);
    ContactState contact;
    contact.normal_n = bad;
    CHECK(sensor.read(contact, 1).saturated);
    CHECK(held(sensor.read(contact, 1)));
    contact = {};
    contact.friction_n = {bad, bad};
    CHECK(sensor.read(contact, 2).saturated);
    CHECK(held(sensor.read(contact, 2)));
    contact = {};
    contact.pose.rx_rad = bad;
    CHECK(held(sensor.read(contact, 3)));
    contact.pose = {.x_m = bad, .y_m = bad};
    contact.normal_n = 5;
    CHECK(held(sensor.read(contact, 4)));
  }
  ContactState denormal;
  denormal.normal_n = std::numeric_limits<double>::denorm_min();
  CHECK_FALSE(sensor.read(denormal, 5).saturated);
  denormal.normal_n = nan;
  sensor.bias(denormal, 6);  // a bias from this reading does no harm
  CHECK(held(sensor.read({}, 7)));
  CHECK_FALSE(sensor.read({}, 8).saturated);
}

TEST_CASE("sensors with parameters that are no numbers give counts of their range all the same") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 1e308, -1e308, 0.0, 5e-324}) {
    ContactState contact;
    contact.normal_n = 5;
    for (int field = 0; field < 7; ++field) {
      FtSensorParams params;
      double* const fields[] = {&params.counts_per_n, &params.range[2],      &params.quantum[2],
                                &params.noise[2],     &params.plate_mass_kg, &params.centre_x_m,
                                &params.height_m};
      *fields[field] = bad;
      FtSensor sensor(params, 1);
      sensor.bias(contact, 1);
      CAPTURE(bad, field);
      const FtReading reading =
          sensor.read(contact, 2);  // the sanitisers detect undefined behaviour
      for (const std::int32_t count : reading.counts)
        CHECK(std::abs(static_cast<double>(count)) <= 2147483648.0);
    }
  }
}

}  // namespace hostile_input_test
