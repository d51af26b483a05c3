#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/analysis/tradeoff/sim/sim_run.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "sim/plant/algebraic/algebraic_probe.hpp"

namespace weft::daemon {
namespace {

using namespace weft::sim;

constexpr std::uint64_t sensor_seed = 1;

/// Reads every sample with `pressure_pa(state, pad, u_m, v_m)`; u_m, v_m: position in the yarns'
/// frame.
template <class Pressure>
void read_with(const SimCase& one, SimTrace& trace, const Pressure& pressure_pa) {
  PadParams params;
  params.noise_counts = params.drift_counts = 0;
  PadArray pads(params, sensor_seed);
  pads.reset(one.patch.seed, one.patch.gain_scale);
  const double skew_cos = std::cos(one.patch.skew_rad), skew_sin = std::sin(one.patch.skew_rad);
  trace.pads.clear();
  for (std::size_t i = 0; i < trace.samples.size(); ++i) {
    const ContactState& state = trace.samples[i];
    for (std::size_t pad = 0; pad < pad_count; ++pad) {
      const double x = state.face_x_m() + pad_dx_m(pad), y = state.face_y_m() + pad_dy_m(pad);
      const double pa = state.normal_n > 0 ? pressure_pa(state, pad, skew_cos * x + skew_sin * y,
                                                         skew_cos * y - skew_sin * x)
                                           : 0;
      pads.convert(pad, pa, i);
    }
    trace.pads.push_back(pads.counts());
  }
}

/// Fills `trace.pads` from its samples. Level L0 reads linear pads; other levels use the fabric's
/// pressure law.
void read_pads(const SimCase& one, Level level, SimTrace& trace) {
  std::array<TextureMap::Cursor, pad_count> cursors{};
  const ContactMaterial& cloth = one.patch.material;
  if (level == Level::algebraic) {
    LinearTexture texture(one.patch.field);
    const AlgebraicProbe contact(one.geometry, one.mount, cloth, SimForceLoop{}.set_n);
    read_with(one, trace, [&](const ContactState& state, std::size_t pad, double u, double v) {
      return contact.pressure_pa(state, pad_dx_m(pad), pad_dy_m(pad),
                                 texture.height_m(u, v, cursors[pad]));
    });
    return;
  }
  TextureMap texture(one.patch.field, cloth.law.lambda_m);
  const ContactModel contact(one.geometry, one.mount, cloth);
  read_with(one, trace, [&](const ContactState& state, std::size_t pad, double u, double v) {
    return contact.pressure_pa(state, pad_dx_m(pad), pad_dy_m(pad),
                               texture.response(u, v, cursors[pad]));
  });
}

constexpr double enough_s = 2e-3;       // processor time of one timing, large enough for the
                                        // clock's resolution
constexpr double finest_share = 27648;  // as a divisor of a sample: 1 us
constexpr double finest_quick_share = 2304;
constexpr double finest_l1_share = 2304;

SimSetting finest(Level level, bool quick) {
  const double share = level == Level::quasistatic ? finest_l1_share
                       : quick                     ? finest_quick_share
                                                   : finest_share;
  return {level, Integrator::midpoint, sim_sample_s / share};
}

/// All cases of a scene with one setting.
Result<std::vector<SimRunner>> runners_of(const SimScene& scene, const SimSetting& setting) {
  std::vector<SimRunner> out;
  for (const SimCase& one : scene.cases) {
    auto runner = SimRunner::make(one, setting);
    if (!runner) return pass(runner.error(), one.name);
    out.push_back(std::move(*runner));
  }
  return out;
}

std::vector<SimTrace> run_all(const SimScene& scene, const std::vector<SimRunner>& runners,
                              Level level) {
  std::vector<SimTrace> out;
  for (std::size_t i = 0; i < runners.size(); ++i) {
    out.push_back(runners[i].run());
    if (scene.cases[i].slides) read_pads(scene.cases[i], level, out.back());
  }
  return out;
}

Result<std::vector<SimTrace>> run_finest(const SimScene& scene, Level level, bool quick) {
  const SimSetting setting = finest(level, quick);
  const auto runners = runners_of(scene, setting);
  if (!runners) return pass(runners.error());
  return run_all(scene, *runners, level);
}

SimDeviation larger(const SimDeviation& a, const SimDeviation& b) {
  return {std::max(a.max, b.max), std::max(a.rms, b.rms)};
}

SimErrors measure_errors(const std::vector<SimTrace>& runs,
                         const std::vector<SimTrace>& reference) {
  SimErrors out;
  std::vector<double> largest, rms;
  bool touches = true;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const SimError error = measure_error(runs[i], reference[i]);
    out.worst_n = larger(out.worst_n, error.force_n);
    out.normal_n = larger(out.normal_n, error.normal_n);
    if (error.pads) out.pads_lsb = larger(out.pads_lsb.value_or(SimDeviation{}), *error.pads);
    touches = touches && error.touch_s.has_value();
    if (error.touch_s) out.touch_s = std::max(out.touch_s.value_or(0), *error.touch_s);
    largest.push_back(error.force_n.max);
    rms.push_back(error.force_n.rms);
  }
  if (!touches) out.touch_s.reset();
  out.median_n = {compute_median(largest), compute_median(rms)};
  return out;
}

std::string failure_of_all(const SimScene& scene, const std::vector<SimTrace>& runs,
                           const std::vector<SimTrace>& reference) {
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::string why = find_failure(scene.cases[i], runs[i], reference[i]);
    if (!why.empty()) return (runs.size() > 1 ? scene.cases[i].name + ": " : "") + why;
  }
  return {};
}

double simulated_s(const SimScene& scene) {
  double sum = 0;
  for (const SimCase& one : scene.cases) sum += one.duration_s();
  return sum;
}

/// The settings to measure: L0 once, L1 and both integrators of L2 at steps from one sample down,
/// L3 at the steps of its sensors.
std::vector<SimSetting> sim_settings(bool quick) {
  const std::vector<int> quasistatic =
      quick ? std::vector{1, 9, 72} : std::vector{1, 3, 9, 18, 36, 72, 144};
  const std::vector<int> dynamic = quick
                                       ? std::vector{1, 72, 144, 288}
                                       : std::vector{1, 3, 9, 18, 36, 72, 144, 216, 288, 576, 2304};
  const std::vector<int> modal = quick ? std::vector{72} : std::vector{72, 288, 576};
  std::vector<SimSetting> out{{Level::algebraic, {}, sim_sample_s}};
  for (const int share : quasistatic) out.push_back({Level::quasistatic, {}, sim_sample_s / share});
  for (const Integrator integrator :
       {Integrator::midpoint, Integrator::adaptive, Integrator::tr_bdf2})
    for (const int share : dynamic)
      out.push_back({Level::dynamic, integrator, sim_sample_s / share});
  for (const int share : modal)
    out.push_back({Level::modal, Integrator::midpoint, sim_sample_s / share});
  return out;
}

/// References for all settings of one scene.
struct Yardsticks {
  std::vector<SimTrace> reference, finest_l1, finest_l2;
  SimErrors l1_to_l2;
  std::optional<SimErrors> l2_to_l3;
};

class SceneTradeoff {
 public:
  SceneTradeoff(SimScene scene, const SimTradeoffOptions& options,
                const std::function<double()>& cpu_seconds)
      : scene_(std::move(scene)), options_(options), cpu_seconds_(cpu_seconds) {}

  Result<SimSceneResult> measure(const SimProgress& progress) {
    if (Status ok = prepare(); !ok) return pass(ok.error(), scene_.name);
    for (const SimSetting& setting : sim_settings(options_.quick)) {
      if (progress) progress(scene_.name + ", " + setting.name());
      add(setting);
    }
    if (Status ok = mark_front(); !ok) return pass(ok.error(), scene_.name);
    return std::move(out_);
  }

 private:
  Status prepare() {
    auto l1 = run_finest(scene_, Level::quasistatic, options_.quick);
    if (!l1) return pass(l1.error());
    auto l2 = run_finest(scene_, Level::dynamic, options_.quick);
    if (!l2) return pass(l2.error());
    yardsticks_.finest_l1 = std::move(*l1);
    yardsticks_.finest_l2 = std::move(*l2);
    out_.scene = scene_.name;
    out_.words = scene_.words;
    out_.cases = scene_.cases.size();
    out_.simulated_s = simulated_s(scene_);
    const auto given = options_.references.find(scene_.name);
    if (given == options_.references.end()) {
      yardsticks_.reference = yardsticks_.finest_l2;
      out_.reference = "this program's own " + finest(Level::dynamic, options_.quick).name();
    } else {
      yardsticks_.reference = given->second.traces;
      out_.reference = given->second.words;
      for (std::size_t i = 0; i < scene_.cases.size(); ++i)
        if (scene_.cases[i].slides)
          read_pads(scene_.cases[i], Level::dynamic, yardsticks_.reference[i]);
      out_.agreement_n = measure_errors(yardsticks_.finest_l2, yardsticks_.reference).worst_n;
    }
    out_.cycle = yardsticks_.reference.front().cycle;
    yardsticks_.l1_to_l2 = measure_errors(yardsticks_.finest_l1, yardsticks_.reference);
    return compare_with_l3();
  }

  /// The force added by rubbing, for scenes with sliding.
  Status compare_with_l3() {
    SimErrors errors;
    std::vector<double> largest, rms;
    for (std::size_t i = 0; i < scene_.cases.size(); ++i) {
      if (!scene_.cases[i].slides) return {};
      const auto added = rubbing_force(scene_.cases[i], yardsticks_.finest_l2[i]);
      if (!added) return pass(added.error());
      errors.worst_n = larger(errors.worst_n, *added);
      largest.push_back(added->max);
      rms.push_back(added->rms);
    }
    errors.median_n = {compute_median(largest), compute_median(rms)};
    yardsticks_.l2_to_l3 = errors;
    return {};
  }

  void add(const SimSetting& setting) {
    const double begin_s = cpu_seconds_();
    const auto runners = runners_of(scene_, setting);
    const double setup_s = cpu_seconds_() - begin_s;
    if (!runners) {
      out_.refusals.push_back({setting, to_string(runners.error())});
      return;
    }
    const std::vector<SimTrace> runs = run_all(scene_, *runners, setting.level);
    SimPoint point;
    point.setting = setting;
    point.setup_s = setup_s;
    point.total = measure_errors(runs, yardsticks_.reference);
    point.failure = failure_of_all(scene_, runs, yardsticks_.reference);
    point.cycle = runs.front().cycle;
    compare_levels(point, runs);
    time(point, *runners);
    out_.points.push_back(std::move(point));
  }

  void compare_levels(SimPoint& point, const std::vector<SimTrace>& runs) const {
    switch (point.setting.level) {
      case Level::algebraic:
        point.model = measure_errors(runs, yardsticks_.finest_l1);
        break;
      case Level::quasistatic:
        point.discretisation = measure_errors(runs, yardsticks_.finest_l1);
        point.model = yardsticks_.l1_to_l2;
        break;
      case Level::dynamic:
        point.model = yardsticks_.l2_to_l3;
        point.discretisation = point.total;
        break;
      default:
        point.discretisation = point.total;
    }
  }

  void time(SimPoint& point, const std::vector<SimRunner>& runners) const {
    const double per_s = 1 / out_.simulated_s;
    std::size_t repeats = 1;
    while (point.timings_s.size() < std::max<std::size_t>(options_.timings, 1)) {
      const double begin_s = cpu_seconds_();
      for (std::size_t k = 0; k < repeats; ++k)
        for (const SimRunner& runner : runners) static_cast<void>(runner.run());
      const double spent_s = cpu_seconds_() - begin_s;
      if (spent_s < enough_s && repeats < 1'000'000) {
        repeats *= 2;
        continue;
      }
      point.timings_s.push_back(spent_s / static_cast<double>(repeats));
    }
    point.best_s = *std::ranges::min_element(point.timings_s) * per_s;
    point.median_s = compute_median(point.timings_s) * per_s;
  }

  Status mark_front() {
    std::vector<TradeoffChoice> bargains;
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < out_.points.size(); ++i) {
      if (!out_.points[i].failure.empty()) continue;
      bargains.push_back({-out_.points[i].total.worst_n.max, out_.points[i].best_s});
      which.push_back(i);
    }
    const auto front = pareto_front(bargains);
    if (!front) return pass(front.error());
    for (const std::size_t k : *front) out_.points[which[k]].front = true;
    return {};
  }

  SimScene scene_;
  const SimTradeoffOptions& options_;
  const std::function<double()>& cpu_seconds_;
  Yardsticks yardsticks_;
  SimSceneResult out_;
};

}  // namespace

Result<std::vector<SimSceneResult>> measure_sim_tradeoff(const FabricLibrary& library,
                                                         const SimTradeoffOptions& options,
                                                         const std::function<double()>& cpu_seconds,
                                                         const SimProgress& progress) {
  std::vector<SimSceneResult> out;
  for (const std::string& name : options.scenes.empty() ? sim_scene_names() : options.scenes) {
    auto scene = make_sim_scene(name, library, options.quick);
    if (!scene) return pass(scene.error());
    auto result = SceneTradeoff(std::move(*scene), options, cpu_seconds).measure(progress);
    if (!result) return pass(result.error());
    out.push_back(std::move(*result));
  }
  return out;
}

}  // namespace weft::daemon
