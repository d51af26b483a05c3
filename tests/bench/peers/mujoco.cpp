// MuJoCo's contact is normalised by mass: the stiffness is given as K/m with an impedance near 0
// (solimp 1e-4). Otherwise the rest position is d times too small (docs/reference/plant.md, Physics
// engines). Built with Debian's library and with PyPI's: only functions of both are called, and
// options with different defaults are set.

#include <mujoco/mujoco.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include "tests/bench/peers/scenes.hpp"

namespace weft::bench::peers {
namespace {

struct Simulation {
  std::unique_ptr<mjModel, void (*)(mjModel*)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, void (*)(mjData*)> data{nullptr, mj_deleteData};

  explicit Simulation(const std::string& xml) {
    const auto path = std::filesystem::temp_directory_path() / "weft_peer_mujoco.xml";
    std::ofstream(path) << xml;
    std::array<char, 500> error{};
    model.reset(mj_loadXML(path.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
    std::filesystem::remove(path);
    if (model)
      data.reset(mj_makeData(model.get()));
    else
      std::fprintf(stderr, "MuJoCo: %s\n", error.data());
  }
};

std::string number(double v) {
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%.17g", v);
  return out.data();
}

std::string press_xml(const Press& scene, double step_s, const std::string& integrator) {
  const std::string contact = " solref=\"" + number(-scene.stiffness_n_m / scene.mass_kg) + " " +
                              number(-scene.damping_n_s_m() / scene.mass_kg) +
                              "\" solimp=\"1e-4 1e-4 1e-3 0.5 2\" condim=\"1\"";
  return "<mujoco><option gravity=\"0 0 0\" timestep=\"" + number(step_s) + "\" integrator=\"" +
         integrator + "\"/><worldbody><geom type=\"plane\" size=\"1 1 1\"" + contact +
         "/><body pos=\"0 0 0.01\"><freejoint/><geom type=\"sphere\" size=\"0.01\" mass=\"" +
         number(scene.mass_kg) + "\"" + contact + "/></body></worldbody></mujoco>";
}

std::string slide_xml(const Slide& scene, double step_s, int noslip) {
  const std::string friction = " friction=\"" + number(scene.friction) + " 0 0\" condim=\"3\"";
  return "<mujoco><option gravity=\"0 0 0\" integrator=\"Euler\" cone=\"elliptic\" timestep=\"" +
         number(step_s) + "\" noslip_iterations=\"" + std::to_string(noslip) +
         "\"/><worldbody><geom type=\"plane\" size=\"1 1 1\"" + friction +
         "/><body pos=\"0 0 0.005\"><freejoint/><geom type=\"box\" size=\"0.008 0.008 0.005\" "
         "mass=\"" +
         number(scene.mass_kg) + "\"" + friction + "/></body></worldbody></mujoco>";
}

Run press_run(const Press& scene, double step_s, const std::string& integrator) {
  Simulation sim(press_xml(scene, step_s, integrator));
  mjModel* const m = sim.model.get();
  mjData* const d = sim.data.get();
  return measure(
      integrator + ", free sphere, solref -K/m -C/m, solimp 1e-4", step_s, scene.duration_s,
      [&](Track& track) {
        mj_resetData(m, d);
        d->qfrc_applied[2] = -scene.force_n;
        step_through(
            step_s, scene.duration_s, track, [&](double) { mj_step(m, d); },
            [&] { return 0.01 - d->qpos[2]; });
      },
      [&](const Track& track) { return press_error(scene, track); });
}

Run slide_run(const Slide& scene, double step_s, int noslip) {
  Simulation sim(slide_xml(scene, step_s, noslip));
  mjModel* const m = sim.model.get();
  mjData* const d = sim.data.get();
  double force = 0;
  return measure(
      "Euler, box, elliptic cone, default solimp, noslip " + std::to_string(noslip), step_s,
      scene.duration_s,
      [&](Track& track) {
        mj_resetData(m, d);
        d->qfrc_applied[2] = -scene.normal_n;
        step_through(
            step_s, scene.duration_s, track,
            [&](double t) {
              force = scene.spring_n_m * (scene.speed_mps * t - d->qpos[0]);
              d->qfrc_applied[0] = force;
              mj_step(m, d);
            },
            [&] { return force; });
      },
      [&](const Track& track) { return slide_error(scene, track); });
}

}  // namespace

Engine engine(const Press& press, const Slide& slide) {
  if (mj_version() != mjVERSION_HEADER) {
    std::fprintf(stderr, "MuJoCo: library %d, headers %d\n", mj_version(), mjVERSION_HEADER);
    std::exit(2);
  }
  Engine out{std::string("MuJoCo ") + mj_versionString(), {}, {}};
  for (const char* integrator : {"Euler", "RK4"})
    for (const double h : {2e-5, 1e-4, 5e-4, 1e-3, 2e-3, 5e-3})
      out.press.push_back(press_run(press, h, integrator));
  for (const int noslip : {0, 20})
    for (const double h : {1e-4, 1e-3, 5e-3}) out.slide.push_back(slide_run(slide, h, noslip));
  return out;
}

}  // namespace weft::bench::peers
