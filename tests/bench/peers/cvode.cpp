// CVODE (SUNDIALS), backward differentiation formulas. States are in units of the scene (static
// indentation, natural frequency): otherwise its tolerance would be meaningless
// (docs/reference/plant.md, Integrators).

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include "tests/bench/peers/scenes.hpp"

namespace weft::bench::peers {
namespace {

struct Scaled {
  double omega, zeta;
};

// x'' = omega^2 (1 - x) - 2 zeta omega x', with y = {x, x'/omega}
int rate(sunrealtype /*t*/, N_Vector y, N_Vector out, void* user) {
  const auto& [omega, zeta] = *static_cast<const Scaled*>(user);
  const double x = NV_Ith_S(y, 0), v = NV_Ith_S(y, 1);
  NV_Ith_S(out, 0) = omega * v;
  NV_Ith_S(out, 1) = omega * (1 - x - 2 * zeta * v);
  return 0;
}

void solve(const Press& scene, int method, double tolerance, Track& track) {
  SUNContext context = nullptr;
  SUNContext_Create(nullptr, &context);
  N_Vector y = N_VNew_Serial(2, context);
  N_VConst(0, y);
  Scaled scaled{std::sqrt(scene.stiffness_n_m / scene.mass_kg), scene.damping_ratio};
  void* memory = CVodeCreate(method, context);
  CVodeInit(memory, rate, 0, y);
  CVodeSStolerances(memory, tolerance, tolerance);
  CVodeSetUserData(memory, &scaled);
  CVodeSetMaxNumSteps(memory, 1'000'000);
  SUNMatrix matrix = SUNDenseMatrix(2, 2, context);
  SUNLinearSolver solver = SUNLinSol_Dense(y, matrix, context);
  CVodeSetLinearSolver(memory, solver, matrix);
  sunrealtype t = 0;
  for (int i = 1; i <= static_cast<int>(std::lround(scene.duration_s / sample_s)); ++i) {
    if (CVode(memory, i * sample_s, y, &t, CV_NORMAL) < 0) break;
    track.emplace_back(t, NV_Ith_S(y, 0) * scene.static_m());
  }
  SUNLinSolFree(solver);
  SUNMatDestroy(matrix);
  CVodeFree(&memory);
  N_VDestroy(y);
  SUNContext_Free(&context);
}

}  // namespace

Engine engine(const Press& press, const Slide& /*slide*/) {
  Engine out{"CVODE 6.4", {}, {}};
  for (const int method : {CV_BDF, CV_ADAMS})
    for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9, 1e-11})
      out.press.push_back(measure(
          std::string(method == CV_BDF ? "BDF" : "Adams") + ", scaled states, tolerance", tolerance,
          press.duration_s, [&](Track& track) { solve(press, method, tolerance, track); },
          [&](const Track& track) { return press_error(press, track); }));
  return out;
}

}  // namespace weft::bench::peers
