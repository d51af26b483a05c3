// ODE in double precision: ERP = h K / (h K + C), CFM = 1 / (h K + C), which is implicit Euler on
// the spring and damper.

#include <ode/ode.h>

#include "tests/bench/peers/scenes.hpp"

namespace weft::bench::peers {
namespace {

// A body over the plane z = 0, with contacts of stiffness and damping.
class TestPlant {
 public:
  TestPlant(double mass_kg, double stiffness_n_m, double damping_n_s_m, double friction,
            double step_s)
      : step_s_(step_s), bench_plant_(dWorldCreate()), group_(dJointGroupCreate(0)) {
    body_ = dBodyCreate(bench_plant_);
    dMass mass;
    dMassSetSphereTotal(&mass, mass_kg, 0.01);
    dBodySetMass(body_, &mass);
    dBodySetMaxAngularSpeed(body_, 0);  // slides without turning
    const double whole = step_s * stiffness_n_m + damping_n_s_m;
    surface_.mode = dContactSoftERP | dContactSoftCFM | dContactApprox1;
    surface_.mu = friction;
    surface_.soft_erp = step_s * stiffness_n_m / whole;
    surface_.soft_cfm = 1 / whole;
  }
  TestPlant(const TestPlant&) = delete;
  TestPlant& operator=(const TestPlant&) = delete;
  ~TestPlant() {
    dJointGroupDestroy(group_);
    dWorldDestroy(bench_plant_);
  }

  void step(double force_x, double force_z) {
    const dReal* at = dBodyGetPosition(body_);
    if (at[2] <= 0) {
      dContact contact{};
      contact.surface = surface_;
      contact.geom.pos[0] = at[0];
      contact.geom.normal[2] = 1;
      contact.geom.depth = -at[2];
      dJointAttach(dJointCreateContact(bench_plant_, group_, &contact), body_, nullptr);
    }
    dBodyAddForce(body_, force_x, 0, force_z);
    dWorldStep(bench_plant_, step_s_);
    dJointGroupEmpty(group_);
  }
  [[nodiscard]] double x() const { return dBodyGetPosition(body_)[0]; }
  [[nodiscard]] double indentation() const { return -dBodyGetPosition(body_)[2]; }

 private:
  double step_s_;
  dWorldID bench_plant_;
  dJointGroupID group_;
  dBodyID body_;
  dSurfaceParameters surface_{};
};

Run press_run(const Press& scene, double step_s) {
  return measure(
      "dWorldStep, point contact, ERP and CFM from K and C", step_s, scene.duration_s,
      [&](Track& track) {
        TestPlant bench_plant(scene.mass_kg, scene.stiffness_n_m, scene.damping_n_s_m(), 0, step_s);
        step_through(
            step_s, scene.duration_s, track, [&](double) { bench_plant.step(0, -scene.force_n); },
            [&] { return bench_plant.indentation(); });
      },
      [&](const Track& track) { return press_error(scene, track); });
}

Run slide_run(const Slide& scene, double step_s) {
  const double damping = 2 * 0.5 * std::sqrt(scene.contact_n_m * scene.mass_kg);
  return measure(
      "dWorldStep, friction pyramid along the motion", step_s, scene.duration_s,
      [&](Track& track) {
        TestPlant bench_plant(scene.mass_kg, scene.contact_n_m, damping, scene.friction, step_s);
        double force = 0;
        step_through(
            step_s, scene.duration_s, track,
            [&](double t) {
              force = scene.spring_n_m * (scene.speed_mps * t - bench_plant.x());
              bench_plant.step(force, -scene.normal_n);
            },
            [&] { return force; });
      },
      [&](const Track& track) { return slide_error(scene, track); });
}

}  // namespace

Engine engine(const Press& press, const Slide& slide) {
  dInitODE();
  Engine out{std::string("ODE 0.16 (") + (sizeof(dReal) == 8 ? "double)" : "single)"), {}, {}};
  for (const double h : {5e-6, 2e-5, 1e-4, 5e-4, 1e-3, 5e-3, 1e-2})
    out.press.push_back(press_run(press, h));
  for (const double h : {1e-4, 1e-3, 5e-3, 1e-2}) out.slide.push_back(slide_run(slide, h));
  dCloseODE();
  return out;
}

}  // namespace weft::bench::peers
