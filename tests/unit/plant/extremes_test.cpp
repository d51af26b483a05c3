// Invariants at the extremes, at every level that moves a probe: balance, energy, friction, memory.
// Tests for finite results are in dynamic_extremes_test.cpp and contact_test.cpp.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "sim/plant/algebraic/algebraic_probe.hpp"
#include "sim/plant/plant.hpp"
#include "sim/plant/stage.hpp"
#include "tests/unit/plant/dynamic_support.hpp"

namespace extremes_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

constexpr double steps_s[] = {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 50e-3};
constexpr double stiffnesses_n_m[] = {1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8};

using Mover = std::function<ContactState(const ContactState&, const Pose&, double)>;

struct Law {
  std::string name;
  Mover step;
};

/// Level L1, and L2 with each of its integrators, on one fabric.
std::vector<Law> laws(const ContactMaterial& material, const Mount& mount = {},
                      const DynamicsParams& params = {}) {
  std::vector<Law> all;
  const ContactModel statics(level_plate(), mount, material);
  all.push_back({"L1", [=](const ContactState& from, const Pose& to, double dt_s) {
                   return statics.step(from, to, dt_s);
                 }});
  for (const Integrator integrator : every) {
    DynamicsParams chosen = params;
    chosen.integrator = integrator;
    const DynamicContact dynamic(level_plate(), mount, material, chosen);
    all.push_back({name_of(integrator), [=](const ContactState& from, const Pose& to, double dt_s) {
                     return dynamic.step(from, to, dt_s);
                   }});
  }
  return all;
}

double top_n(const ContactMaterial& material) {
  return level_plate().face_area_m2() * material.law.pressure_pa;
}

double depth_m(const ContactMaterial& material, double force_n) {
  return material.law.lambda_m * std::log1p(force_n / top_n(material));
}

/// The z stage position at which a fabric without memory is pressed with `force_n` above the
/// weight.
double stage_z_m(const ContactMaterial& material, const Mount& mount, double force_n) {
  return plate_z - material.thickness_m + depth_m(material, force_n) +
         (force_n - mount.weight_n()) / mount.stiffness_n_m;
}

/// At rest under `force_n`.
ContactState pressed(const ContactMaterial& material, const Mount& mount, double force_n) {
  return ContactModel(level_plate(), mount, material)
      .step({}, {.z_m = stage_z_m(material, mount, force_n)}, 0);
}

}  // namespace

TEST_CASE("1e1 to 1e8 N/m, 1 us to 50 ms, no damping: at rest under 10 N it stays at rest") {
  const ContactMaterial material = plain("denim");
  for (const double stiffness : stiffnesses_n_m)
    for (const double step_s : steps_s) {
      Mount mount;
      mount.stiffness_n_m = stiffness;
      DynamicsParams params = undamped(step_s);
      params.lateral_stiffness_n_m = stiffness;
      const ContactState start = pressed(material, mount, 10);
      for (const Law& law : laws(material, mount, params)) {
        ContactState state = start;
        for (int i = 0; i < 50; ++i) state = law.step(state, state.pose, 4 * step_s);
        CAPTURE(law.name, stiffness, step_s);
        CHECK(state.normal_n == Approx(10).epsilon(1e-8));
        CHECK(state.indentation_m == Approx(depth_m(material, 10)).epsilon(1e-8));
        CHECK(std::abs(state.velocity_mps[2]) < 1e-8);
        CHECK(state.friction_n == Vector2{});
      }
    }
}

TEST_CASE("1e1 to 1e8 N/m, 1 us to 50 ms, no damping: a swing keeps its energy or loses it") {
  // The swing is small enough that fabric and mount are one linear spring.
  const ContactMaterial material = plain("denim");
  for (const double stiffness : stiffnesses_n_m)
    for (const double step_s : steps_s) {
      Mount mount;
      mount.stiffness_n_m = stiffness;
      const double k = stiffness + (5 + top_n(material)) / material.law.lambda_m;
      const double omega = std::sqrt(k / mount.mass_kg);
      // At most the compression of the mount's spring: otherwise the probe would leave it.
      const double way_m =
          std::min(1e-3 * material.law.lambda_m, 0.5 * (5 - mount.weight_n()) / stiffness);
      const ContactState rest = pressed(material, mount, 5);
      const auto energy_j = [&](const ContactState& state) {
        const double x = state.probe_z_m() - rest.probe_z_m(), v = state.velocity_mps[2];
        return 0.5 * k * x * x + 0.5 * mount.mass_kg * v * v;
      };
      for (const Integrator integrator : every) {
        const DynamicContact contact(level_plate(), mount, material, undamped(step_s, integrator));
        ContactState state = rest;
        state.velocity_mps[2] = way_m * omega;
        const double before = energy_j(state);
        for (int i = 0; i < 200; ++i) {
          state = contact.step(state, state.pose, 5 * step_s);
          CAPTURE(stiffness, step_s, i);
          REQUIRE(energy_j(state) < 1.01 * before);
          if (integrator != Integrator::tr_bdf2) REQUIRE(energy_j(state) > 0.99 * before);
        }
        // TR-BDF2 keeps the motion that its step resolves and damps the rest.
        if (integrator == Integrator::tr_bdf2 && step_s * omega < 0.02)
          CHECK(energy_j(state) > 0.98 * before);
        if (integrator == Integrator::tr_bdf2 && step_s * omega > 10)
          CHECK(energy_j(state) < 1e-6 * before);
      }
    }
}

TEST_CASE("ten million steps: L1 comes to the balance of the relaxed cloth and stays there") {
  ContactMaterial material = plain("felt");
  material.relaxation = {{0.2, 0.15}, {0.3, 5}};
  const Mount mount;
  const ContactModel model(level_plate(), mount, material);
  const double z_m = stage_z_m(material, mount, 8);
  // 0.65 F_e(d) = W + k (z - surface - d)
  double low = 0, high = 2e-3;
  for (int i = 0; i < 200; ++i) {
    const double d = 0.5 * (low + high);
    const double extension = z_m - (plate_z - material.thickness_m) - d;
    const double residual = mount.weight_n() + mount.force_n(extension) -
                            0.65 * top_n(material) * std::expm1(d / material.law.lambda_m);
    (residual > 0 ? low : high) = d;
  }
  const double expected = 0.65 * top_n(material) * std::expm1(low / material.law.lambda_m);
  ContactState state = model.step({}, {.z_m = z_m}, 0);
  CHECK(state.normal_n == Approx(8).epsilon(1e-9));
  for (int i = 0; i < 10'000'000; ++i) state = model.step(state, state.pose, 1e-4);
  CHECK(state.normal_n == Approx(expected).epsilon(1e-9));
  CHECK(state.indentation_m == Approx(low).epsilon(1e-9));
}

TEST_CASE("ten million steps of L2 keep a swing in contact, without damping") {
  const ContactMaterial material = plain("silk");
  const Mount mount;
  const double k = mount.stiffness_n_m + (5 + top_n(material)) / material.law.lambda_m;
  const double omega = std::sqrt(k / mount.mass_kg), way_m = 1e-3 * material.law.lambda_m;
  const ContactState rest = pressed(material, mount, 5);
  const DynamicContact contact(level_plate(), mount, material, undamped(1e-4));
  ContactState state = rest;
  state.velocity_mps[2] = way_m * omega;
  const double before = 0.5 * mount.mass_kg * way_m * omega * way_m * omega;
  for (int i = 0; i < 100; ++i) {
    state = contact.step(state, state.pose, 10);
    const double x = state.probe_z_m() - rest.probe_z_m(), v = state.velocity_mps[2];
    REQUIRE(0.5 * k * x * x + 0.5 * mount.mass_kg * v * v == Approx(before).epsilon(0.01));
  }
}

TEST_CASE("friction at 0, 4 and just over 4 mm/s is the law's, without a step between them") {
  const ContactMaterial material = [] {
    ContactMaterial cloth = plain("jersey");
    cloth.friction = {0.2, 5, 0.9, 150e-6};
    return cloth;
  }();
  const Mount mount;
  const DynamicsParams params = with_step(2e-4);
  const auto fall = [&](double v) {
    return 1 + (params.static_ratio - 1) * std::exp(-std::pow(v / params.stribeck_speed_mps, 2));
  };
  for (const Law& law : laws(material, mount, params)) {
    const bool dynamic = law.name[1] == '2';
    double at_limit_n = 0;
    for (const double speed : {0.0, 4e-3, 4.0001e-3}) {
      ContactState state = pressed(material, mount, 5);
      for (int i = 1; i <= 800; ++i)
        state = law.step(state, {.y_m = speed * 3e-3 * i, .z_m = state.pose.z_m}, 3e-3);
      const double expected = material.friction.sliding_n(5) *
                              (dynamic ? fall(speed) / fall(params.friction_speed_mps) : 1);
      CAPTURE(law.name, speed);
      CHECK(state.normal_n == Approx(5).epsilon(1e-6));
      CHECK(state.friction_n[1] == Approx(speed > 0 ? expected : 0).epsilon(1e-6).margin(1e-12));
      CHECK(std::abs(state.friction_n[0]) < 1e-12);
      if (speed == 4e-3) at_limit_n = state.friction_n[1];
      if (speed > 4e-3) CHECK(state.friction_n[1] == Approx(at_limit_n).epsilon(1e-4));
    }
  }
}

TEST_CASE("moves shorter than v^2/a change the force by the mount's stiffness, without a jump") {
  // A profile that ignores this jumps by 5 N here: 4 mm/s with 5 mm/s2 need 3.2 mm.
  const ContactMaterial material = plain("nylon");
  const Mount mount;
  constexpr MotionLimits slow{4e-3, 5e-3};
  const double start_m = stage_z_m(material, mount, 5);
  for (const Law& law : laws(material, mount, with_step(1e-4)))
    for (const double way_m : {0.4e-6, 3e-6, 40e-6, 90e-6, -40e-6}) {
      Stage stage({.low = 0, .high = 0.15, .start = start_m, .quantum = 0});
      stage.move_to(start_m + way_m, slow, {});
      ContactState state = pressed(material, mount, 5);
      double last_n = 5, last_z = start_m, worst = 0;
      for (int i = 1; i <= 150; ++i) {
        const TimePoint t{Duration(std::int64_t{3'072'000} * i)};
        state = law.step(state, {.z_m = stage.position(t)}, 3.072e-3);
        const double most = mount.stiffness_n_m * std::abs(stage.position(t) - last_z);
        worst = std::max(worst, std::abs(state.normal_n - last_n) - most);
        last_n = state.normal_n;
        last_z = stage.position(t);
      }
      CAPTURE(law.name, way_m);
      CHECK(worst < (law.name[1] == '1' ? 1e-9 : 0.02));  // at L2 the probe swings a little
      const double k_cloth = (5 + top_n(material)) / material.law.lambda_m;
      const double in_series = 1 / (1 / mount.stiffness_n_m + 1 / k_cloth);
      CHECK(state.normal_n - 5 == Approx(in_series * way_m).epsilon(0.01).margin(2e-4));
    }
}

TEST_CASE("contact that is lost is zero in everything, and found again is as it was") {
  const ContactMaterial material = whole("velvet");
  const double touch = plate_z - material.thickness_m;
  for (const Law& law : laws(material, {}, with_step(2e-3))) {
    ContactState state = hanging(material, touch - 1e-3);
    double peaks_n[2] = {};
    for (double& peak_n : peaks_n) {
      for (int i = 1; i <= 500; ++i) {
        state = law.step(state, {.y_m = 1e-6 * i, .z_m = touch - 1e-3 + 4e-6 * i}, 3e-3);
        peak_n = std::max(peak_n, state.normal_n);
      }
      state = law.step(state, {.z_m = touch - 3e-3}, 1);
      CAPTURE(law.name);
      CHECK(state.normal_n == 0);
      CHECK(state.friction_n == Vector2{});
      CHECK(state.bristle == Vector2{});
      CHECK(state.load_ratio == 0);
      state = law.step(state, state.pose, 100);
      CHECK(state.extension_m == Approx(Mount{}.hanging_extension_m()).epsilon(1e-6));
      state = law.step(law.step(state, {.z_m = touch - 1e-3}, 1), {.z_m = touch - 1e-3}, 30);
    }
    CHECK(peaks_n[0] > 3);
    CHECK(peaks_n[1] == Approx(peaks_n[0]).epsilon(1e-6));
  }
}

TEST_CASE(
    "a cloth of a nanometre's lambda under a jump of 10 cm is a rigid one, without overflow") {
  for (const double stiffness : {1e1, 1e4, 1e8}) {
    ContactMaterial material = plain("silk");
    material.law.lambda_m = 1e-9;
    Mount mount;
    mount.stiffness_n_m = stiffness;
    DynamicsParams params = with_step(0.05);
    params.normal_damping = 1;
    const double z_m = plate_z - material.thickness_m + 0.1;
    for (const Law& law : laws(material, mount, params)) {
      ContactState state = law.step(hanging(material, plate_z - 2e-3, mount), {.z_m = z_m}, 0.01);
      for (int i = 0; i < 2000; ++i) state = law.step(state, state.pose, 0.05);
      CAPTURE(law.name, stiffness);
      CHECK((state.normal_n >= 0 && state.normal_n < 2.561e8));  // the law is limited at 1e12 Pa
      // The midpoint rule does not damp a motion that a step of 50 ms does not resolve.
      if (law.name != name_of(Integrator::midpoint) && law.name != name_of(Integrator::adaptive)) {
        CHECK(state.normal_n == Approx(mount.weight_n() + 0.1 * stiffness).epsilon(1e-5));
        CHECK(state.indentation_m == Approx(depth_m(material, state.normal_n)).epsilon(1e-5));
      }
      const ContactModel statics(level_plate(), mount, material);
      for (const double texture : {0.0, 1.0, 1e30, 1e308}) {
        const double pressure_pa = statics.pressure_pa(state, 6e-3, -6e-3, texture);
        CHECK((pressure_pa >= 0 && pressure_pa <= 1e12));
      }
    }
  }
}

TEST_CASE("the smallest numbers there are change nothing, and a fading memory ends at zero") {
  constexpr double tiny = std::numeric_limits<double>::denorm_min();
  const ContactMaterial material = whole("wool");
  for (const Law& law : laws(material, {}, with_step(0.05))) {
    ContactState start = law.step(hanging(material, plate_z - 1e-3), {.z_m = plate_z}, 1e-3);
    start = law.step(start, start.pose, 60);
    ContactState state = start;
    for (int i = 0; i < 50; ++i) {
      const Pose pose{
          .x_m = state.pose.x_m + tiny, .z_m = plate_z, .rx_rad = tiny, .ry_rad = -tiny};
      state = law.step(state, pose, tiny);
      REQUIRE(std::isfinite(state.friction_n[0]));
      REQUIRE(state.normal_n == Approx(start.normal_n).epsilon(1e-9));
    }
    state = law.step(state, {.z_m = plate_z - 5e-3}, 1);  // without this step it would rattle on
                                                          // its stop
    for (int i = 0; i < 2000; ++i) state = law.step(state, state.pose, 10);  // 4000 times 5 s
    CAPTURE(law.name);
    CHECK(state.normal_n == 0);
    CHECK(state.relaxation.relaxed_n == RelaxationState{}.relaxed_n);
    CHECK(std::isfinite(state.velocity_mps[2]));
  }
}

TEST_CASE("a set-point of 0 or 10 N is the force of level L0") {
  const ContactMaterial material = whole("cotton");
  for (const double set_n : {0.0, 10.0}) {
    const AlgebraicContact contact(level_plate(), material, set_n);
    const ContactState state = contact.step({}, {.z_m = plate_z});
    CHECK(state.normal_n == set_n);
    CHECK(state.indentation_m == Approx(depth_m(material, set_n)).epsilon(1e-12).margin(1e-20));
    CHECK(contact.pressure_pa(state, 0, 0, 0) ==
          Approx(set_n / level_plate().face_area_m2()).epsilon(1e-12));
  }
}

TEST_CASE("a run of L1 that is stopped and taken up again has the same bits") {
  const ContactMaterial material = whole("terry");
  const ContactModel model(level_plate(), {}, material);
  const auto path = [&](int i) { return down_and_up(material, i); };
  ContactState single = hanging(material, path(0).z_m), split = single;
  for (int i = 1; i <= 2000; ++i) single = model.step(single, path(i), 3.072e-3);
  for (int i = 1; i <= 2000; ++i) {
    static_cast<void>(model.step(split, path(i), 1.7e-3));  // an observer looks in between
    const ContactModel again = model;
    split = again.step(split, path(i), 3.072e-3);
  }
  same_bits(split, single);
}

TEST_CASE("a whole plant that is looked into and moved elsewhere goes on bit for bit") {
  for (const Level level : {Level::quasistatic, Level::dynamic}) {
    PlantParams params;
    params.level = level;
    params.geometry = level_plate();
    const auto pose = [](int i) {
      return Pose{.y_m = 6e-6 * i, .z_m = plate_z - 2e-3 + 2e-6 * std::min(i, 800)};
    };
    const auto run = [&](Plant& plant, int from, int to, bool watched) {
      for (int i = from; i < to; ++i) {
        if (watched) static_cast<void>(plant.peek(pose(i), 1.1e-3));
        plant.advance(pose(i), 3.072e-3);
        plant.convert(i % pad_timing::stages, static_cast<std::uint64_t>(i / pad_timing::stages));
      }
    };
    Plant single(params, 3), first(params, 3);
    single.mount(patch_of(library(), "corduroy", 7), pose(0));
    first.mount(patch_of(library(), "corduroy", 7), pose(0));
    run(single, 0, 1200, false);
    run(first, 0, 517, true);
    Plant second = std::move(first);
    run(second, 517, 1200, true);
    CHECK(second.pad_counts() == single.pad_counts());
    same_bits(second.contact(), single.contact());
  }
}

}  // namespace extremes_test
