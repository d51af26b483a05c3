// Costs of scenes: one second of sliding at 2 mm/s under 5 N on denim, with only the computations
// that the scene needs; one static press; and whole runs, with names that begin with "run-"
// (run_scenes.hpp).
//
//   bench_scene_costs          processor time of every scene except the whole runs
//   bench_scene_costs --list   all names
//   bench_scene_costs NAME     prepares the scene, then runs measured_part() once:
//                              tests/bench/scene_costs.py counts its instructions

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>

#include "sim/devices/bench_plant.hpp"
#include "sim/devices/ft_sensor.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/imprint/half_space.hpp"
#include "sim/plant/imprint/height_map.hpp"
#include "sim/plant/imprint/objects.hpp"
#include "tests/bench/figures.hpp"
#include "tests/bench/run_scenes.hpp"

namespace {

using namespace weft;
using namespace weft::sim;

constexpr double plate_z_m = 0.06;

struct MovingScene {
  const char* name;
  Level level;
  bool wrench, taxels, accelerometer, microphone;
};
constexpr MovingScene moving_scenes[] = {
    {"stages", Level::algebraic, false, false, false, false},
    {"wrench-means", Level::algebraic, true, false, false, false},
    {"taxel-means", Level::algebraic, true, true, false, false},
    {"wrench", Level::quasistatic, true, false, false, false},
    {"taxels", Level::quasistatic, true, true, false, false},
    {"wrench-overshoot", Level::dynamic, true, false, false, false},
    {"taxels-overshoot", Level::dynamic, true, true, false, false},
    {"accelerometer", Level::modal, true, true, true, false},
    {"microphone", Level::modal, true, true, false, true},
    {"accelerometer-microphone", Level::modal, true, true, true, true}};
constexpr const char* static_scenes[] = {"imprint-Z", "imprint-Z+"};

template <class T>
T required(Result<T> value) {
  if (value) return std::move(*value);
  std::fprintf(stderr, "%s\n", to_string(value.error()).c_str());
  std::exit(1);
}

Patch denim() {
  std::ifstream file("sim/fabrics.json");
  std::stringstream text;
  text << file.rdbuf();
  FabricLibrary library = required(parse_fabrics(text.str()));
  library.params.cover = {};  // rigid face: the depth below is that of 5 N on the bare fabric
  return required(
      cut_patch(*library.find("denim"), library.params, library.spread, MaterialSwitches{}, 1));
}

BenchPlantParams make_plant_params(const MovingScene& scene, const Patch& patch) {
  BenchPlantParams params;
  for (StageParams& stage : params.stages) stage = {.low = -0.2, .high = 0.2, .start = 0.03};
  params.stages[2].start = plate_z_m - patch.material.thickness_m - 2e-3;
  params.stages[3].start = params.stages[4].start = 0;
  PlantParams& plant = params.plant;
  plant.geometry.plate_z_m = plate_z_m;
  plant.mount.slack_m = 1e-3;
  plant.level = scene.level;
  plant.watched = {scene.wrench || scene.taxels, scene.taxels};
  if (!scene.accelerometer) plant.vibration.accelerometer.reset();
  if (!scene.microphone) plant.vibration.microphone.reset();
  return params;
}

/// A bench with a probe that slides under about 5 N.
class Sliding {
 public:
  explicit Sliding(const MovingScene& scene)
      : wrench_(scene.wrench),
        sensor_({}, 1),
        patch_(denim()),
        bench_plant_(make_plant_params(scene, patch_), 1) {
    bench_plant_.mount(patch_, {});
    const double down_m = plate_z_m - patch_.material.thickness_m + 0.62e-3;
    bench_plant_.stage(AxisId::z, {}).move_to(down_m, {2e-3, 0.02}, {});
    run_for(3);
    bench_plant_.stage(AxisId::y, now_).move_to(0.05, {2e-3, 0.02}, now_);
    run_for(1);
  }

  /// Like a rig: the force sensor reads at 100 Hz, the pads' frames come at 37 Hz.
  void run_for(double seconds) {
    for (int i = 0; i < static_cast<int>(100 * seconds); ++i) {
      now_ += std::chrono::milliseconds(10);
      if (wrench_) fz_counts_ += sensor_.read(bench_plant_.contact(now_), sample_++).counts[2];
      frames_ += bench_plant_.frame(now_).counts[5];
    }
  }
  [[nodiscard]] double force_n() { return bench_plant_.contact(now_).normal_n; }

 private:
  bool wrench_;
  FtSensor sensor_;
  Patch patch_;
  BenchPlant bench_plant_;
  TimePoint now_{};
  std::uint32_t sample_ = 0;
  std::int64_t fz_counts_ = 0, frames_ = 0;
};

std::function<void()> prepared(const std::string& name) {
  if (name.starts_with("run-")) return [name] { bench::run_scene(name); };
  for (const MovingScene& scene : moving_scenes) {
    if (name != scene.name) continue;
    auto sliding = std::make_shared<Sliding>(scene);
    const double force_n = sliding->force_n();
    if ((scene.wrench || scene.taxels) && !(force_n > 3 && force_n < 8)) {
      std::fprintf(stderr, "%s: presses with %.2f N, not about 5\n", scene.name, force_n);
      std::exit(1);
    }
    return [sliding] { sliding->run_for(1); };
  }
  const ObjectSpec screen = *find_object("SCREEN1");
  const HeightMap map =
      required(place(screen, calibrated_side, calibrated_side, taxel_spacing_m, 1));
  if (name == "imprint-Z")
    return [map, screen] { required(press_winkler(map, bed_under(screen), light_press_n)); };
  if (name == "imprint-Z+") {
    HalfSpaceParams params;
    params.modulus_pa = modulus_under(screen);
    auto half_space = std::make_shared<HalfSpace>(
        required(HalfSpace::make(map.rows, map.cols, map.spacing_m, params)));
    return [map, half_space] { required(half_space->press(map, light_press_n)); };
  }
  std::fprintf(stderr, "no such scene: %s\n", name.c_str());
  std::exit(1);
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const MovingScene& scene : moving_scenes) all.emplace_back(scene.name);
  for (const char* name : static_scenes) all.emplace_back(name);
  return all;
}

int processor_times() {
  std::vector<bench::Figure> figures;
  for (const std::string& name : names()) {
    std::vector<double> times_s;
    for (int i = 0; i < 5; ++i) {
      const std::function<void()> run = prepared(name);
      const std::clock_t begin = std::clock();
      run();
      times_s.push_back(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    }
    const bool moves = name.rfind("imprint", 0) != 0;
    figures.push_back({name, bench::median(times_s) * 1e6,
                       moves ? "us a simulated second" : "us a press", "", 0, ""});
  }
  return bench::report("scene_costs", figures);
}

}  // namespace

/// In the global namespace and out of line, for callgrind's --toggle-collect.
__attribute__((noinline)) void measured_part(const std::function<void()>& run) {
  run();
}

int main(int argc, char** argv) {
  if (argc < 2) return processor_times();
  if (std::strcmp(argv[1], "--list") == 0) {
    for (const std::string& name : names()) std::printf("%s\n", name.c_str());
    for (const std::string& name : bench::run_scene_names()) std::printf("%s\n", name.c_str());
    return 0;
  }
  measured_part(prepared(argv[1]));
  return 0;
}
