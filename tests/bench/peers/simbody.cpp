// Simbody's mobilised slider with its spring and damper: it has no contact, so the spring also
// pulls. Users set its accuracy.

#include <Simbody.h>

#include "tests/bench/peers/scenes.hpp"

namespace weft::bench::peers {
namespace {

template <class Integrator>
Run press_run(const Press& scene, double accuracy, const std::string& name) {
  using namespace SimTK;
  MultibodySystem system;
  SimbodyMatterSubsystem matter(system);
  GeneralForceSubsystem forces(system);
  const Body::Rigid body(MassProperties(scene.mass_kg, Vec3(0), UnitInertia(1)));
  MobilizedBody::Slider slider(matter.Ground(), body);
  const Force::MobilityLinearSpring spring(forces, slider, MobilizerUIndex(0), scene.stiffness_n_m,
                                           0);
  const Force::MobilityLinearDamper damper(forces, slider, MobilizerUIndex(0),
                                           scene.damping_n_s_m());
  const Force::MobilityConstantForce push(forces, slider, MobilizerUIndex(0), scene.force_n);
  system.realizeTopology();
  return measure(
      name + ", slider with spring and damper, accuracy", accuracy, scene.duration_s,
      [&](Track& track) {
        Integrator integrator(system);
        integrator.setAccuracy(accuracy);
        TimeStepper stepper(system, integrator);
        stepper.initialize(system.getDefaultState());
        for (int i = 1; i <= static_cast<int>(std::lround(scene.duration_s / sample_s)); ++i) {
          stepper.stepTo(i * sample_s);
          track.emplace_back(i * sample_s, slider.getOneQ(integrator.getState(), 0));
        }
      },
      [&](const Track& track) { return press_error(scene, track); });
}

}  // namespace

Engine engine(const Press& press, const Slide& /*slide*/) {
  Engine out{"Simbody 3.7", {}, {}};
  for (const double accuracy : {1e-2, 1e-4, 1e-6, 1e-8})
    out.press.push_back(press_run<SimTK::RungeKuttaMersonIntegrator>(press, accuracy, "RKMerson"));
  for (const double accuracy : {1e-2, 1e-4, 1e-6})
    out.press.push_back(press_run<SimTK::CPodesIntegrator>(press, accuracy, "CPodes"));
  return out;
}

}  // namespace weft::bench::peers
