// The plant's levels L1 to L3: processor time on one core for a simulated second (of the contact
// alone, of the plant with its pads, and of the whole bench in a regulated slide), and the error in
// force. SIMULATED throughout.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "sim/devices/bench_plant.hpp"
#include "tests/bench/figures.hpp"
#include "tests/bench/plant_scene.hpp"
#include "tests/bench/shipped_fabrics.hpp"

namespace {

using namespace weft;
using namespace weft::sim;
using bench::Figure;

constexpr int runs = 5;
constexpr double plate_z_m = 0.06;
constexpr double grid_s = 3.072e-3;
constexpr double slide_mps = 2e-3, slide_s = 25, set_n = 5;

/// Processor time of this process only: the machine may have other work.
double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

Patch patch_of(const FabricLibrary& library, const char* name, bool texture) {
  MaterialSwitches switches;
  switches.texture = texture;
  return *cut_patch(*library.find(name), library.params, library.spread, switches, 1);
}

BenchPlantParams make_plant_params(Level level, const DynamicsParams& dynamics,
                                   const Patch& patch) {
  BenchPlantParams params;
  for (StageParams& stage : params.stages) stage = {.low = -0.2, .high = 0.2, .start = 0.03};
  params.stages[2].start = plate_z_m - patch.material.thickness_m - 3e-3;
  params.stages[3].start = params.stages[4].start = 0;
  params.plant.geometry.plate_z_m = plate_z_m;
  params.plant.geometry.tilt_axis_y_m = 0.075;
  params.plant.mount.slack_m = 1e-3;
  params.plant.level = level;
  params.plant.dynamics = dynamics;
  return params;
}

struct Run {
  double cpu_s = 0, simulated_s = 0, rms_error_n = 0;
};

/// A press to 5 N, held by an integral controller at 37 Hz while the probe slides 50 mm.
Run regulated_slide(const BenchPlantParams& params, const Patch& patch) {
  const double begin = cpu_s();
  BenchPlant bench_plant(params, 1);
  bench_plant.mount(patch, {});
  const int ticks = static_cast<int>(37 * (6 + slide_s));
  double z_m = params.stages[2].start, squares = 0;
  TimePoint now{};
  for (int i = 0; i < ticks; ++i) {
    now += Duration(pad_timing::frame_ns);
    const double force_n = bench_plant.contact(now).normal_n;
    const double error_n = set_n - force_n;
    z_m += force_n > 0.1 ? std::clamp(5e-6 * error_n, -10e-6, 10e-6) : 50e-6;
    bench_plant.stage(AxisId::z, now).move_to(z_m, {2e-3, 0.02}, now);
    if (i == 37 * 6) bench_plant.stage(AxisId::y, now).move_to(0.03 + 0.05, {slide_mps, 0.02}, now);
    if (i >= 37 * 8) squares += error_n * error_n / (ticks - 37 * 8);
  }
  return {cpu_s() - begin, to_seconds(now - TimePoint{}), std::sqrt(squares)};
}

ContactGeometry contact_geometry() {
  return {.plate_z_m = plate_z_m, .tilt_axis_y_m = 0.075};
}

/// The same press and slide as a table of poses: without a controller, so that runs can be
/// compared.
std::vector<Pose> scripted_path(const Patch& patch) {
  std::vector<Pose> path;
  const double touch_m = plate_z_m - patch.material.thickness_m;
  double z_m = touch_m - 1.5e-3, y_m = 0.03;
  const double stop_m = touch_m + patch.material.law.lambda_m * 7.5 + 0.15e-3;
  const int points = static_cast<int>(30 / grid_s);
  for (int i = 0; i < points; ++i) {
    if (z_m < stop_m)
      z_m += 1e-3 * grid_s;
    else if (i * grid_s > 5)
      y_m += slide_mps * grid_s;
    path.push_back({.x_m = 0.03, .y_m = y_m, .z_m = z_m});
  }
  return path;
}

/// Path of a press and a slide under a force loop at 37 Hz with a reading in steps of 20 mN, on
/// whole micrometres, with the finest contact. Runs can be compared along it, although the loop
/// would react differently in each of them.
std::vector<Pose> regulated_path(const Patch& patch, const DynamicContact& finest) {
  constexpr int points = pad_timing::stages + 1;
  std::vector<Pose> path;
  double z_m = plate_z_m - patch.material.thickness_m - 1.5e-3, y_m = 0.03;
  ContactState state = ContactModel(contact_geometry(), {}, patch.material)
                           .step({}, {.x_m = 0.03, .y_m = y_m, .z_m = z_m}, 0);
  for (int scan = 0; scan < static_cast<int>(30 / (points * grid_s)); ++scan) {
    const double force_n = 0.02 * std::round(state.normal_n / 0.02);
    const double z_mps = force_n < 2.5 ? 1e-3 : std::clamp(2e-4 * (set_n - force_n), -1e-3, 1e-3);
    for (int i = 0; i < points; ++i) {
      z_m += z_mps * grid_s;
      if (scan * points * grid_s > 5) y_m += slide_mps * grid_s;
      path.push_back({.x_m = 0.03, .y_m = y_m, .z_m = 1e-6 * std::round(z_m * 1e6)});
      state = finest.step(state, path.back(), grid_s);
    }
  }
  return path;
}

/// Every pad's count of every scan along the path, nine poses a scan.
std::vector<double> counts_along(const PlantParams& params, const Patch& patch,
                                 const std::vector<Pose>& path) {
  constexpr int points = pad_timing::stages + 1;
  constexpr double scan_s = static_cast<double>(pad_timing::frame_ns) * 1e-9;
  Plant plant(params, 1);
  plant.mount(patch, path.front());
  std::vector<double> counts;
  for (std::size_t i = 0; i + points <= path.size(); i += points) {
    for (int stage = 0; stage < pad_timing::stages; ++stage) {
      plant.advance(path[i + static_cast<std::size_t>(stage)], grid_s);
      plant.convert(stage, i / points);
    }
    plant.advance(path[i + points - 1], scan_s - pad_timing::stages * grid_s);
    for (const std::uint16_t count : plant.pad_counts()) counts.push_back(count);
  }
  return counts;
}

struct Trace {
  double cpu_s = 0;
  std::vector<double> normal_n, friction_n;
};

template <class Contact>
Trace follow(const Contact& contact, ContactState state, const std::vector<Pose>& path,
             std::size_t stride) {
  Trace trace;
  const double begin = cpu_s();
  for (std::size_t i = stride - 1; i < path.size(); i += stride) {
    state = contact.step(state, path[i], grid_s * static_cast<double>(stride));
    if ((i + 1) % 9 != 0) continue;
    trace.normal_n.push_back(state.normal_n);
    trace.friction_n.push_back(state.friction_n[1]);
  }
  trace.cpu_s = cpu_s() - begin;
  return trace;
}

double worst(const std::vector<double>& a, const std::vector<double>& b) {
  double error = 0;
  for (std::size_t i = 0; i < a.size(); ++i) error = std::max(error, std::abs(a[i] - b[i]));
  return error;
}

double rms(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

struct Setting {
  std::string name;
  Integrator integrator;
  double step_s;
};

const Setting settings[] = {
    {"L2 midpoint 0.1 ms", Integrator::midpoint, 1e-4},
    {"L2 midpoint 0.2 ms", Integrator::midpoint, 2e-4},
    {"L2 midpoint 0.384 ms", Integrator::midpoint, 3.84e-4},
    {"L2 adaptive 0.048 ms", Integrator::adaptive, 4.8e-5},
    {"L2 adaptive 0.096 ms", Integrator::adaptive, 9.6e-5},
    {"L2 (adaptive 0.192 ms)", DynamicsParams{}.integrator, DynamicsParams{}.step_s},
    {"L2 adaptive 0.128 ms", Integrator::adaptive, 1.28e-4},
    {"L2 midpoint 1 ms", Integrator::midpoint, 1.024e-3},
    {"L2 midpoint 3 ms", Integrator::midpoint, grid_s},
    {"L2 TR-BDF2 1 ms", Integrator::tr_bdf2, 1.024e-3},
    {"L2 TR-BDF2 3 ms", Integrator::tr_bdf2, grid_s}};

DynamicsParams params_of(const Setting& setting) {
  DynamicsParams params;
  params.integrator = setting.integrator;
  params.step_s = setting.step_s;
  return params;
}

class Bench {
 public:
  void whole(const std::string& name, Level level, const DynamicsParams& dynamics,
             const Patch& patch, double target) {
    const BenchPlantParams params = make_plant_params(level, dynamics, patch);
    std::vector<double> factors;
    Run run;
    for (int i = 0; i < runs; ++i) {
      run = regulated_slide(params, patch);
      factors.push_back(run.simulated_s / run.cpu_s);
    }
    char note[64];
    std::snprintf(note, sizeof note, "force held to %.1f mN rms", 1e3 * run.rms_error_n);
    add(name, bench::median(factors), "x real time", target, note);
  }

  /// Runs the scene of plant_scene.hpp several times. The extra time of the first run is that of
  /// the texture's maps.
  void plant(const std::string& name, const PlantParams& params, const Patch& patch,
             double target) {
    bench::Scene scene(params, patch);
    std::vector<double> seconds;
    bench::SceneResult result;
    for (int i = 0; i <= runs; ++i) {
      const double begin = cpu_s();
      result = scene.run();
      seconds.push_back(cpu_s() - begin);
    }
    const double cold_s = seconds.front();
    seconds.erase(seconds.begin());
    const double warm_s = bench::median(seconds);
    char note[96];
    std::snprintf(note, sizeof note, "maps once %.1f ms; 5 N held to %.1f mN rms; %zu readings",
                  1e3 * (cold_s - warm_s), 1e3 * result.rms_error_n, result.readings);
    add(name, bench::scene_s / warm_s, "x real time", target, note);
  }

  /// Compares counts of the pads along the scripted path with those of a balance at every
  /// conversion.
  void counts(const std::string& name, const PlantParams& params, const Patch& patch) {
    const auto path = scripted_path(patch);
    const auto coarse = counts_along(params, patch, path);
    const auto fine = counts_along(bench::scene_params(Level::quasistatic), patch, path);
    double worst_counts = 0, squares = 0;
    for (std::size_t i = 0; i < fine.size(); ++i) {
      const double error = coarse[i] - fine[i];
      worst_counts = std::max(worst_counts, std::abs(error));
      squares += error * error / static_cast<double>(fine.size());
    }
    add(name + ", pads beside a balance at every conversion, rms", std::sqrt(squares), "counts", 0,
        "a pad's noise is 1.5 counts rms");
    add(name + ", pads beside a balance at every conversion, worst", worst_counts, "counts", 0, {});
  }

  /// `step_s` is 0 unless all substeps are equal.
  template <class Contact>
  void alone(const std::string& name, const Contact& contact, const Patch& patch,
             const std::vector<Pose>& path, std::size_t stride, double step_s, const Trace& truth,
             double target) {
    const ContactState start = start_of(patch, path);
    std::vector<double> seconds;
    Trace trace;
    for (int i = 0; i < runs; ++i) {
      trace = follow(contact, start, path, stride);
      seconds.push_back(trace.cpu_s);
    }
    const double simulated_s = grid_s * static_cast<double>(path.size());
    const double median_s = bench::median(seconds);
    const double step_of_grid = grid_s * static_cast<double>(stride);
    add(name + ", contact alone", simulated_s / median_s, "x real time", target, {});
    if (step_s > 0) {
      const double substeps =
          simulated_s / step_of_grid * std::ceil(step_of_grid / step_s * 0.999999);
      add(name + ", one substep", median_s / substeps * 1e9, "ns", 0, {});
    }
    add(name + ", worst error of normal force", worst(trace.normal_n, truth.normal_n), "N", 0, {});
    add(name + ", rms error of normal force", rms(trace.normal_n, truth.normal_n), "N", 0, {});
    add(name + ", rms error of friction", rms(trace.friction_n, truth.friction_n), "N", 0, {});
  }

  static ContactState start_of(const Patch& patch, const std::vector<Pose>& path) {
    return ContactModel(contact_geometry(), {}, patch.material).step({}, path.front(), 0);
  }
  [[nodiscard]] int finish() const { return bench::report("plant_levels", figures_); }

 private:
  void add(const std::string& figure, double value, const std::string& unit, double target,
           const std::string& note) {
    figures_.push_back({figure, value, unit, target > 0 ? "target" : "", target, note});
  }
  std::vector<Figure> figures_;
};

PlantParams at_step(double step_s, Integrator integrator = Integrator::midpoint) {
  PlantParams params = bench::scene_params(Level::dynamic);
  params.dynamics.step_s = step_s;
  params.dynamics.integrator = integrator;
  return params;
}

/// The contact is balanced once per scan of the pads.
PlantParams once_per_scan() {
  PlantParams params = bench::scene_params(Level::quasistatic);
  params.quasistatic_step_s = static_cast<double>(pad_timing::frame_ns) * 1e-9;
  return params;
}

/// Accelerometer at 200 Hz, microphone at 16 kHz.
PlantParams sounding() {
  PlantParams params = bench::scene_params(Level::modal);
  ConverterParams& microphone = params.vibration.microphone->converter;
  microphone.period_ns = params.vibration.step_ns;
  microphone.bandwidth_hz = 7200;
  return params;
}

void plants(Bench& bench, const std::string& of, const Patch& patch) {
  bench.plant(of + "L1, plant, maps apart", bench::scene_params(Level::quasistatic), patch, 20000);
  bench.plant(of + "L1 27.03 ms, plant, maps apart", once_per_scan(), patch, 20000);
  bench.counts(of + "L1 27.03 ms", once_per_scan(), patch);
  bench.plant(of + "L2 (adaptive 0.192 ms), plant, maps apart", bench::scene_params(Level::dynamic),
              patch, 1000);
  bench.plant(of + "L2 midpoint 0.2 ms, plant, maps apart", at_step(2e-4), patch, 1000);
  bench.plant(of + "L2 midpoint 1 ms, plant, maps apart", at_step(1.024e-3), patch, 1000);
  bench.plant(of + "L3, plant, maps apart", sounding(), patch, 100);
}

}  // namespace

int main() {
  double load[3] = {};
  if (getloadavg(load, 3) > 0) std::printf("load of the machine at the start: %.1f\n", load[0]);
  const FabricLibrary library = bench::shipped_fabrics();
  Bench bench;
  for (const char* name : {"denim", "satin"}) {
    const Patch patch = patch_of(library, name, true), smooth = patch_of(library, name, false);
    const std::string of = std::string(name) + ": ";
    const auto path = scripted_path(patch);
    DynamicsParams finest;
    finest.step_s = 5e-6;
    finest.integrator = Integrator::midpoint;
    const DynamicContact best(contact_geometry(), {}, patch.material, finest);
    const auto looped = regulated_path(patch, best);
    const Trace truth = follow(best, Bench::start_of(patch, path), path, 1);
    const Trace looped_truth = follow(best, Bench::start_of(patch, looped), looped, 1);
    const ContactModel quasistatic(contact_geometry(), {}, patch.material);
    plants(bench, of, patch);
    bench.whole(of + "L1, whole bench", Level::quasistatic, {}, patch, 20000);
    bench.whole(of + "L1, whole bench, maps apart", Level::quasistatic, {}, smooth, 20000);
    bench.alone(of + "L1 at 37 Hz", quasistatic, patch, path, 9, 1, truth, 20000);
    bench.alone(of + "L1 at 3 ms", quasistatic, patch, path, 1, 1, truth, 20000);
    for (const Setting& setting : settings) {
      const DynamicsParams dynamics = params_of(setting);
      const DynamicContact contact(contact_geometry(), {}, patch.material, dynamics);
      const double equal_s = setting.integrator == Integrator::adaptive ? 0 : setting.step_s;
      bench.whole(of + setting.name + ", whole bench", Level::dynamic, dynamics, patch, 1000);
      bench.whole(of + setting.name + ", whole bench, maps apart", Level::dynamic, dynamics, smooth,
                  1000);
      bench.alone(of + setting.name, contact, patch, path, 1, equal_s, truth, 1000);
      bench.alone(of + setting.name + ", path of a force loop", contact, patch, looped, 1, equal_s,
                  looped_truth, 1000);
    }
  }
  return bench.finish();
}
