// A second solution of the equations of level L2 (docs/reference/plant.md, Contact law and
// Friction) by SUNDIALS CVODE, for `weft trade sim --reference`. It shares only the scenes with the
// product: the force law, the Prony series, the hysteresis, LuGre, the mount and the probe are
// written here as ordinary differential equations. Every corner is located as a root, and the
// solver is restarted behind it: touch and lift-off, reversal of the compression, ends of the
// mount's slack, a fabric that no longer pushes, reversal of the slip, and every change of the
// stages' velocity.
//
//   bench_sim_reference OUT.json [SCENE ...]

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <memory>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"
#include "daemon/analysis/tradeoff/sim/sim_run.hpp"

namespace {

using namespace weft;
using namespace weft::daemon;
using weft::sim::ContactState;
using weft::sim::Pose;

constexpr double relative_tolerance = 1e-12;
constexpr double same_velocity_mps = 1e-12;  // smaller changes of the stages' velocity are ignored
constexpr double peek_s = 1e-9;              // step that shows the direction of the motion behind a
                                             // corner

/// z counts from the height at which the probe would touch a flat fabric, q in newtons.
enum Variable { z, vz, lag, vy, bristle, q1, q2, branch, variables };
using State = std::array<double, variables>;
constexpr State absolute_tolerance{1e-16, 1e-14, 1e-16, 1e-14, 1e-12, 1e-12, 1e-12, 1e-12};

/// Functions; their sign chooses a branch of the equations.
enum Corner { touch, compression, push, spring, stop, slip, corners };
using Signs = std::array<bool, corners>;  // true: positive
using Values = std::array<double, corners>;

/// Stages on a straight line.
struct Line {
  double t_s, y_m, y_mps, z_m, z_mps;
};

struct Forces {
  double exponent, exponent_rate, elastic_n, normal_n, mount_n, friction_n, bristle_rate;
};

class Equations {
 public:
  explicit Equations(const SimCase& one)
      : case_(one),
        cloth_(one.patch.material),
        dynamics_(one.dynamics),
        damper_(2 * dynamics_.normal_damping *
                std::sqrt(one.mount.stiffness_n_m * one.mount.mass_kg)),
        guide_damper_(2 * dynamics_.lateral_damping *
                      std::sqrt(dynamics_.lateral_stiffness_n_m * one.mount.mass_kg)) {
    const double half = one.geometry.face_half_width_m / cloth_.law.lambda_m;
    touch_z_m_ = one.geometry.plate_z_m - cloth_.thickness_m -
                 cloth_.law.lambda_m * (sim::log_sinhc(one.geometry.tilt_x * half) +
                                        sim::log_sinhc(one.geometry.tilt_y * half));
  }

  [[nodiscard]] double touch_z_m() const { return touch_z_m_; }

  [[nodiscard]] Forces forces(double t_s, const State& y, const Line& line,
                              const Signs& sign) const {
    Forces f{};
    const double place_m = line.y_m + line.y_mps * (t_s - line.t_s) - y[lag];
    const double w_mps = line.y_mps + y[vy];
    const auto waves = cloth_.waviness.tangent(line_x_m, place_m);
    f.exponent = (y[z] + waves.height_m) / cloth_.law.lambda_m;
    f.exponent_rate = (y[vz] + waves.slope_y * w_mps) / cloth_.law.lambda_m;
    if (sign[touch]) {
      const double eta = cloth_.hysteresis.eta;
      f.elastic_n = case_.geometry.face_area_m2() * cloth_.law.pressure_pa *
                    std::expm1(f.exponent) * (1 + eta * y[branch]) / (1 + eta);
      if (sign[push]) f.normal_n = f.elastic_n - y[q1] - y[q2];
    }
    const double extension_m = line.z_m + line.z_mps * (t_s - line.t_s) - touch_z_m_ - y[z];
    const sim::Mount& m = case_.mount;
    f.mount_n = sign[spring]  ? m.stiffness_n_m * extension_m
                : !sign[stop] ? m.stop_stiffness_n_m * (extension_m + m.slack_m)
                              : 0;
    rub(f, y[bristle], w_mps, sign[slip]);
    return f;
  }

  [[nodiscard]] State rates(double t_s, const State& y, const Line& line, const Signs& sign) const {
    const Forces f = forces(t_s, y, line, sign);
    const sim::Mount& m = case_.mount;
    State out{};
    out[z] = y[vz];
    out[vz] = (m.weight_n() + f.mount_n + damper_ * (line.z_mps - y[vz]) - f.normal_n) / m.mass_kg;
    out[lag] = -y[vy];
    out[vy] = (dynamics_.lateral_stiffness_n_m * y[lag] - guide_damper_ * y[vy] - f.friction_n) /
              m.mass_kg;
    out[bristle] = f.bristle_rate;
    const sim::Relaxation& r = cloth_.relaxation;
    out[q1] = (r.share[0] * f.elastic_n - y[q1]) / r.time_s[0];
    out[q2] = (r.share[1] * f.elastic_n - y[q2]) / r.time_s[1];
    const double target = sign[compression] ? 1 : -1;
    if (sign[touch] && cloth_.hysteresis.eta > 0)
      out[branch] = (target - y[branch]) * target * f.exponent_rate / cloth_.hysteresis.length;
    return out;
  }

  [[nodiscard]] Values corner_values(double t_s, const State& y, const Line& line,
                                     Signs sign) const {
    sign[touch] = sign[push] = true;  // as if the probe touched
    const Forces f = forces(t_s, y, line, sign);
    const double extension_m = line.z_m + line.z_mps * (t_s - line.t_s) - touch_z_m_ - y[z];
    return {f.exponent,
            f.exponent_rate,
            f.normal_n,
            extension_m,
            extension_m + case_.mount.slack_m,
            line.y_mps + y[vy]};
  }

 private:
  void rub(Forces& f, double b, double w_mps, bool forward) const {
    if (!(f.normal_n > 0) || !(cloth_.friction.coefficient > 0)) return;
    const auto ratio = [&](double u) {
      const double x = u / dynamics_.stribeck_speed_mps;
      return 1 + (dynamics_.static_ratio - 1) * std::exp(-x * x);
    };
    const double speed = forward ? w_mps : -w_mps, l_m = cloth_.friction.bristle_length_m;
    const double kinetic_n =
        cloth_.friction.coefficient * cloth_.friction.reference_load_n *
        std::pow(f.normal_n / cloth_.friction.reference_load_n, cloth_.friction.exponent) /
        ratio(dynamics_.friction_speed_mps);
    const double sigma1 =
        2 * dynamics_.bristle_damping * std::sqrt(kinetic_n / l_m * case_.mount.mass_kg);
    f.bristle_rate = (w_mps - speed * b / ratio(speed)) / l_m;
    f.friction_n = kinetic_n * b + sigma1 * l_m * f.bristle_rate + dynamics_.viscous_n_s_m * w_mps;
  }

  static constexpr double line_x_m = 0;  // the scenes move along y
  const SimCase& case_;
  const sim::ContactMaterial& cloth_;
  const sim::DynamicsParams& dynamics_;
  double damper_, guide_damper_, touch_z_m_ = 0;
};

struct Problem {
  Equations equations;
  Line line{};
  Signs sign{};
};

State state_of(N_Vector v) {
  State out{};
  std::copy_n(NV_DATA_S(v), std::size_t{variables}, out.begin());
  return out;
}

int rates_for_cvode(sunrealtype t, N_Vector y, N_Vector out, void* user) {
  const auto& p = *static_cast<const Problem*>(user);
  const State rates = p.equations.rates(t, state_of(y), p.line, p.sign);
  std::copy(rates.begin(), rates.end(), NV_DATA_S(out));
  return 0;
}

int corners_for_cvode(sunrealtype t, N_Vector y, sunrealtype* out, void* user) {
  const auto& p = *static_cast<const Problem*>(user);
  const Values values = p.equations.corner_values(t, state_of(y), p.line, p.sign);
  std::copy(values.begin(), values.end(), out);
  return 0;
}

/// CVODE with one case's equations.
class Solver {
 public:
  explicit Solver(const SimCase& one) : problem_{Equations(one)} {
    SUNContext_Create(nullptr, &context_);
    y_ = N_VNew_Serial(variables, context_);
    tolerance_ = N_VNew_Serial(variables, context_);
    std::copy(absolute_tolerance.begin(), absolute_tolerance.end(), NV_DATA_S(tolerance_));
    N_VConst(0, y_);
    memory_ = CVodeCreate(CV_ADAMS, context_);
    CVodeInit(memory_, rates_for_cvode, 0, y_);
    CVodeSVtolerances(memory_, relative_tolerance, tolerance_);
    CVodeSetUserData(memory_, &problem_);
    CVodeSetMaxNumSteps(memory_, 10'000'000);
    matrix_ = SUNDenseMatrix(variables, variables, context_);
    linear_ = SUNLinSol_Dense(y_, matrix_, context_);
    CVodeSetLinearSolver(memory_, linear_, matrix_);
    CVodeRootInit(memory_, corners, corners_for_cvode);
    CVodeSetNoInactiveRootWarn(memory_);
  }
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;
  ~Solver() {
    SUNLinSolFree(linear_);
    SUNMatDestroy(matrix_);
    CVodeFree(&memory_);
    N_VDestroy(tolerance_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }

  [[nodiscard]] const Equations& equations() const { return problem_.equations; }
  [[nodiscard]] State state() const { return state_of(y_); }
  [[nodiscard]] Forces forces(double t_s) const {
    return equations().forces(t_s, state(), problem_.line, problem_.sign);
  }
  [[nodiscard]] std::vector<double> touches() && { return std::move(touches_); }
  [[nodiscard]] long events() const { return events_; }

  void begin(const State& y, const Line& line) {
    std::copy(y.begin(), y.end(), NV_DATA_S(y_));
    problem_.line = line;
    restart(line.t_s);
  }

  /// Continues with the stages on another line.
  void follow(const Line& line) {
    const Line& old = problem_.line;
    const bool same = std::abs(line.y_mps - old.y_mps) < same_velocity_mps &&
                      std::abs(line.z_mps - old.z_mps) < same_velocity_mps;
    problem_.line = line;
    if (!same) restart(line.t_s);
  }

  void advance(double to_s) {
    sunrealtype t = 0;
    CVodeSetStopTime(memory_, to_s);
    for (;;) {
      const int result = CVode(memory_, to_s, y_, &t, CV_NORMAL);
      if (result < 0) throw std::runtime_error("CVODE gives up at " + std::to_string(t) + " s");
      if (result != CV_ROOT_RETURN) return;
      if (++events_ > most_events) throw std::runtime_error("no end of corners");
      const bool touched = problem_.sign[touch];
      restart(t);
      if (problem_.sign[touch] && !touched) touches_.push_back(t);
    }
  }

 private:
  static constexpr long most_events = 1'000'000;

  /// Restarts with the signs of a moment later, and clears the states that a corner resets.
  void restart(double t_s) {
    State y = state();
    const State rates = equations().rates(t_s, y, problem_.line, problem_.sign);
    State soon = y;
    for (std::size_t i = 0; i < variables; ++i) soon[i] += peek_s * rates[i];
    const Values values =
        equations().corner_values(t_s + peek_s, soon, problem_.line, problem_.sign);
    for (std::size_t i = 0; i < corners; ++i) problem_.sign[i] = values[i] > 0;
    if (!problem_.sign[touch]) y[branch] = -1;
    if (!problem_.sign[touch] || !problem_.sign[push]) y[bristle] = 0;
    std::copy(y.begin(), y.end(), NV_DATA_S(y_));
    CVodeReInit(memory_, t_s, y_);
  }

  Problem problem_;
  SUNContext context_ = nullptr;
  N_Vector y_ = nullptr, tolerance_ = nullptr;
  void* memory_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver linear_ = nullptr;
  std::vector<double> touches_;
  long events_ = 0;
};

ContactState contact_of(const SimCase& one, const Solver& solver, const Pose& pose, double t_s) {
  const State y = solver.state();
  const Forces f = solver.forces(t_s);
  ContactState out;
  out.pose = pose;
  out.slope_x = one.geometry.tilt_x;
  out.slope_y = one.geometry.tilt_y;
  out.extension_m = pose.z_m - solver.equations().touch_z_m() - y[z];
  out.indentation_m = out.probe_z_m() - (one.geometry.plate_z_m - one.patch.material.thickness_m);
  out.exponent = f.exponent;
  out.lag_m[1] = y[lag];
  out.velocity_mps = {0, y[vy], y[vz]};
  out.normal_n = f.normal_n;
  out.friction_n[1] = f.friction_n;
  const double top_n = one.geometry.face_area_m2() * one.patch.material.law.pressure_pa;
  if (f.normal_n > 0) out.load_ratio = f.normal_n / (top_n * std::expm1(f.exponent));
  return out;
}

SimTrace solve(const SimCase& one) {
  Solver solver(one);
  const ContactState start = one.start();
  State y{};
  y[z] = start.probe_z_m() - solver.equations().touch_z_m();
  y[branch] = -1;
  SimDrive drive(one);
  CycleWatch cycle;
  SimTrace out;
  Pose pose = start.pose;
  double normal_n = 0;
  const std::size_t points = one.samples * one.grid_points();
  for (std::size_t i = 0; i < points; ++i) {
    const Pose next = drive.move(i, i + 1, normal_n);
    const double t_s = static_cast<double>(i) * one.grid_s;
    const double end_s = static_cast<double>(i + 1) * one.grid_s;
    const Line line{t_s, pose.y_m, (next.y_m - pose.y_m) / one.grid_s, pose.z_m,
                    (next.z_m - pose.z_m) / one.grid_s};
    i == 0 ? solver.begin(y, line) : solver.follow(line);
    solver.advance(end_s);
    pose = next;
    const ContactState contact = contact_of(one, solver, pose, end_s);
    normal_n = contact.normal_n;
    const double k = one.dynamics.lateral_stiffness_n_m;
    if (one.cycles_at(end_s))
      cycle.see({end_s, k * contact.lag_m[1], -k * contact.velocity_mps[1]});
    if ((i + 1) % one.grid_points() == 0) out.samples.push_back(contact);
  }
  std::fprintf(stderr, "  %s: %ld corners\n", one.name.c_str(), solver.events());
  out.touch_s = std::move(solver).touches();
  out.cycle = {cycle.peak_to_peak(), cycle.frequency_hz()};
  return out;
}

std::string format_text(const char* path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

int make(const char* out, std::vector<std::string> names) {
  const auto library = sim::parse_fabrics(format_text("sim/fabrics.json"));
  if (!library) throw std::runtime_error(to_string(library.error()));
  if (names.empty()) names = sim_scene_names();
  std::vector<SimScene> scenes;
  std::vector<std::vector<SimTrace>> traces;
  for (const std::string& name : names) {
    auto scene = make_sim_scene(name, *library);
    if (!scene) throw std::runtime_error(to_string(scene.error()));
    std::fprintf(stderr, "%s\n", name.c_str());
    traces.emplace_back();
    for (const SimCase& one : scene->cases) traces.back().push_back(solve(one));
    scenes.push_back(std::move(*scene));
  }
  std::vector<ReferenceScene> all;
  for (std::size_t i = 0; i < scenes.size(); ++i) all.push_back({scenes[i], traces[i]});
  std::ofstream(out) << write_references(
      "SUNDIALS CVODE " SUNDIALS_VERSION
      ", Adams, relative tolerance 1e-12, corners located as roots",
      all);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: bench_sim_reference OUT.json [SCENE ...]\n");
    return 2;
  }
  try {
    return make(argv[1], {argv + 2, argv + argc});
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
