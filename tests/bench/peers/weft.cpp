// Weft's own levels on the same scenes: the exact oscillator for the press, levels L1 and L2 of the
// contact for the slide.

#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "sim/plant/modal/converter.hpp"
#include "tests/bench/peers/scenes.hpp"

namespace weft::bench::peers {
namespace {

using namespace weft::sim;

Run press_run(const Press& scene, double step_s) {
  const Oscillator oscillator{scene.mass_kg, scene.damping_n_s_m(), scene.stiffness_n_m};
  return measure(
      "exact piecewise-linear oscillator", step_s, scene.duration_s,
      [&](Track& track) {
        const auto step = OscillatorStep::make(oscillator, step_s).value();
        OscillatorState state;
        step_through(
            step_s, scene.duration_s, track,
            [&](double) { state = step.advance(state, scene.force_n, scene.force_n); },
            [&] { return state.x_m; });
      },
      [&](const Track& track) { return press_error(scene, track); });
}

ContactMaterial cloth(const Slide& scene) {
  ContactMaterial out;
  out.law = {scene.normal_n / scene.contact_n_m, 100, 0};  // gives that stiffness under that load
  out.friction = {scene.friction, scene.normal_n, 1.0, 50e-6};
  return out;
}

// The z position at which the probe presses on the fabric with the scene's force at rest.
double pressed_z_m(const Slide& scene, const ContactModel& contact) {
  double low = -1e-2, high = 1e-2;
  for (int i = 0; i < 100; ++i) {
    const double z = 0.5 * (low + high);
    (contact.step({}, {.z_m = z}, 0).normal_n < scene.normal_n ? low : high) = z;
  }
  return low;
}

// `contact.step(state, pose, dt)` is that of either level.
template <class Contact>
Run slide_run(const Slide& scene, const std::string& setting, double step_s, double z_m,
              const Contact& contact) {
  return measure(
      setting, step_s, scene.duration_s,
      [&](Track& track) {
        ContactState state;
        state.pose.z_m = z_m;
        state = contact.step(state, state.pose, 0);
        step_through(
            step_s, scene.duration_s, track,
            [&](double t) {
              state =
                  contact.step(state, {.x_m = scene.speed_mps * (t + step_s), .z_m = z_m}, step_s);
            },
            [&] { return state.friction_n[0]; });
      },
      [&](const Track& track) { return slide_error(scene, track); });
}

}  // namespace

Engine engine(const Press& press, const Slide& slide) {
  Engine out{"Weft", {}, {}};
  for (const double h : {1e-4, 1e-3, 5e-3}) out.press.push_back(press_run(press, h));
  const ContactGeometry geometry;
  Mount mount;
  mount.mass_kg = slide.mass_kg;
  const ContactMaterial material = cloth(slide);
  const ContactModel quasistatic(geometry, mount, material);
  const double z_m = pressed_z_m(slide, quasistatic);
  for (const double h : {1e-3, 5e-3, 25e-3}) {
    out.slide.push_back(
        slide_run(slide, "L1, no spring: the face is where the stage is", h, z_m, quasistatic));
    out.slide.back().compared = false;
  }
  for (const Integrator integrator :
       {Integrator::midpoint, Integrator::adaptive, Integrator::tr_bdf2}) {
    for (const double h : {2e-4, 1e-3, 5e-3}) {
      DynamicsParams params;
      params.step_s = h;
      params.integrator = integrator;
      params.lateral_stiffness_n_m = slide.spring_n_m;
      params.static_ratio = 1;
      const std::string name =
          "L2, " + std::string(to_string(integrator)) + ", spring of the scene";
      out.slide.push_back(
          slide_run(slide, name, h, z_m, DynamicContact(geometry, mount, material, params)));
    }
  }
  return out;
}

}  // namespace weft::bench::peers
