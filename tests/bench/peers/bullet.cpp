// Bullet in double precision, with its own contact stiffness and damping.

#include <btBulletDynamicsCommon.h>

#include "tests/bench/peers/scenes.hpp"

namespace weft::bench::peers {
namespace {

constexpr double radius_m = 0.01;

class TestPlant {
 public:
  TestPlant(double mass_kg, double stiffness_n_m, double damping_n_s_m, double friction)
      : dispatcher_(&configuration_),
        bench_plant_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        plane_(btVector3(0, 0, 1), 0),
        sphere_(radius_m),
        floor_(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane_)),
        body_(btRigidBody::btRigidBodyConstructionInfo(mass_kg, nullptr, &sphere_,
                                                       btVector3(0, 0, 0))) {
    btTransform at;
    at.setIdentity();
    at.setOrigin(btVector3(0, 0, radius_m));
    body_.setWorldTransform(at);
    body_.setActivationState(DISABLE_DEACTIVATION);
    body_.setContactStiffnessAndDamping(stiffness_n_m, damping_n_s_m);
    body_.setFriction(friction);
    body_.setAngularFactor(0);  // slides without turning
    floor_.setFriction(1);
    bench_plant_.setGravity(btVector3(0, 0, 0));
    bench_plant_.addRigidBody(&floor_);
    bench_plant_.addRigidBody(&body_);
  }
  TestPlant(const TestPlant&) = delete;
  TestPlant& operator=(const TestPlant&) = delete;
  ~TestPlant() {
    bench_plant_.removeRigidBody(&body_);
    bench_plant_.removeRigidBody(&floor_);
  }

  void step(double force_x, double force_z, double step_s) {
    body_.applyCentralForce(btVector3(force_x, 0, force_z));
    bench_plant_.stepSimulation(step_s, 0);
  }
  [[nodiscard]] double x() const { return body_.getWorldTransform().getOrigin().x(); }
  [[nodiscard]] double indentation() const {
    return radius_m - body_.getWorldTransform().getOrigin().z();
  }

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld bench_plant_;
  btStaticPlaneShape plane_;
  btSphereShape sphere_;
  btRigidBody floor_, body_;
};

Run press_run(const Press& scene, double step_s) {
  return measure(
      "sphere on plane, contact stiffness and damping", step_s, scene.duration_s,
      [&](Track& track) {
        TestPlant bench_plant(scene.mass_kg, scene.stiffness_n_m, scene.damping_n_s_m(), 0);
        step_through(
            step_s, scene.duration_s, track,
            [&](double) { bench_plant.step(0, -scene.force_n, step_s); },
            [&] { return bench_plant.indentation(); });
      },
      [&](const Track& track) { return press_error(scene, track); });
}

Run slide_run(const Slide& scene, double step_s) {
  const double damping = 2 * 0.5 * std::sqrt(scene.contact_n_m * scene.mass_kg);
  return measure(
      "sphere that cannot turn, contact stiffness and damping", step_s, scene.duration_s,
      [&](Track& track) {
        TestPlant bench_plant(scene.mass_kg, scene.contact_n_m, damping, scene.friction);
        double force = 0;
        step_through(
            step_s, scene.duration_s, track,
            [&](double t) {
              force = scene.spring_n_m * (scene.speed_mps * t - bench_plant.x());
              bench_plant.step(force, -scene.normal_n, step_s);
            },
            [&] { return force; });
      },
      [&](const Track& track) { return slide_error(scene, track); });
}

}  // namespace

Engine engine(const Press& press, const Slide& slide) {
  Engine out{"Bullet " + std::to_string(btGetVersion()) + " (double)", {}, {}};
  for (const double h : {1e-5, 1e-4, 5e-4, 1e-3, 5e-3}) out.press.push_back(press_run(press, h));
  for (const double h : {1e-4, 1e-3, 5e-3, 1e-2}) out.slide.push_back(slide_run(slide, h));
  return out;
}

}  // namespace weft::bench::peers
