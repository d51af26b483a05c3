#include "daemon/analysis/tradeoff/sim/downstream.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/analysis/tradeoff/sim/sim_scene.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon {

namespace {

using namespace weft::sim;
using namespace paper_slide;

constexpr double slack_m = 1e-3, start_m = 0.03;
constexpr double gain_m_n = 5e-6, most_m = 10e-6;
constexpr MotionLimits quick_move{4e-3, 0.02}, small_move{2e-3, 0.02};
constexpr double rest_s = 3, press_s = 6, end_s = 2, settle_s = 0.5;
constexpr double across_step_n = 10e-3, normal_step_n = 20e-3;  // Mini40 SI-40-2 [E]
constexpr double noise_steps = 0.5;

BenchPlantParams make_plant_params(const DownstreamLevel& level) {
  BenchPlantParams out;
  for (StageParams& stage : out.stages) stage = {.low = -0.2, .high = 0.2, .start = start_m};
  out.stages[2].start = 0.045;
  out.stages[3].start = out.stages[4].start = 0;
  out.plant.geometry.plate_z_m = plate_z_m;
  out.plant.geometry.tilt_axis_y_m = 0.075;
  out.plant.mount.slack_m = slack_m;
  out.plant.level = level.level;
  out.plant.set_point_n = set_n;
  out.plant.dynamics.integrator = Integrator::midpoint;  // equal substeps, as the level's name
                                                         // states
  if (level.step_s > 0) out.plant.dynamics.step_s = level.step_s;
  return out;
}

/// A piece determines the surface. A trial determines the position on the plate and the current
/// material properties.
Result<Patch> make_patch(const Fabric& fabric, const FabricLibrary& library, std::uint64_t swatch,
                         std::uint64_t trial) {
  const auto surface = cut_patch(fabric, library.params, library.spread, {}, swatch);
  if (!surface) return pass(surface.error());
  auto out = cut_patch(fabric, library.params, library.spread, {}, trial);
  if (!out) return pass(out.error());
  out->field = surface->field;
  out->material.waviness = surface->material.waviness;
  out->offset_x_m = surface->offset_x_m;  // every trial touches the piece at the same place
  out->offset_y_m = surface->offset_y_m;
  return out;
}

/// One trial in progress.
class Exploration {
 public:
  Exploration(const DownstreamLevel& level, const Patch& patch, std::uint64_t rig_seed)
      : bench_plant_(make_plant_params(level), rig_seed), noise_(mix(patch.seed, "force sensor")) {
    bench_plant_.mount(patch, now_);
    const ContactMaterial& cloth = patch.material;
    const Mount mount{.slack_m = slack_m};
    const double top_n = ContactGeometry{}.face_area_m2() * cloth.law.pressure_pa;
    const double sunk_m = cloth.law.lambda_m * std::log1p(mount.weight_n() / top_n);
    rest_z_m_ = plate_z_m - cloth.thickness_m + sunk_m - slack_m / 2;
    pads_.taxels = pad_count;
    force_.taxels = 3;
  }

  void run(double slide_s) {
    move(AxisId::z, rest_z_m_, quick_move);
    const double approach_s = to_seconds(bench_plant_.stage(AxisId::z).end() - now_);
    frames(Phase::none, approach_s + settle_s, false);
    frames(Phase::rest, rest_s, false);
    frames(Phase::press, press_s, true);
    move(AxisId::y, start_m + slide_mps * slide_s, {slide_mps, 0.02});
    frames(Phase::motion, slide_s, true);
    move(AxisId::z, rest_z_m_, small_move);
    frames(Phase::end, end_s, false);
  }

  [[nodiscard]] classifier::Trial pads() && { return std::move(pads_); }
  [[nodiscard]] classifier::Trial force() && { return std::move(force_); }

 private:
  void move(AxisId axis, double to_m, const MotionLimits& limits) {
    if (axis == AxisId::z) z_m_ = to_m;
    bench_plant_.stage(axis, now_).move_to(to_m, limits, now_);
  }

  void frames(Phase phase, double for_s, bool regulated) {
    const double frame_s = 1e-9 * static_cast<double>(pad_timing::frame_ns);
    const int count = static_cast<int>(std::lround(for_s / frame_s));
    for (int i = 0; i < count; ++i) {
      now_ += Duration(pad_timing::frame_ns);
      const ContactState contact = bench_plant_.contact(now_);
      if (regulated)
        move(AxisId::z, z_m_ + std::clamp(gain_m_n * (set_n - contact.normal_n), -most_m, most_m),
             small_move);
      if (phase != Phase::none) record(phase, contact);
    }
  }

  void record(Phase phase, const ContactState& contact) {
    for (const std::uint16_t count : bench_plant_.frame(now_).counts) pads_.counts.push_back(count);
    pads_.phase.push_back(phase);
    const auto read = [&](double force_n, double step_n) {
      force_.counts.push_back(std::round(force_n / step_n + noise_steps * noise_.gaussian()));
    };
    read(contact.friction_n[0], across_step_n);
    read(contact.friction_n[1], across_step_n);
    read(contact.normal_n, normal_step_n);
    force_.phase.push_back(phase);
  }

  BenchPlant bench_plant_;
  Random noise_;
  TimePoint now_{};
  double rest_z_m_ = 0, z_m_ = 0;
  classifier::Trial pads_, force_;
};

void name(classifier::Trial& trial, const std::string& fabric, std::size_t swatch,
          std::size_t number) {
  trial.label = fabric;
  trial.group = std::to_string(swatch + 1);
  trial.file = fabric + "/" + trial.group + "/" + std::to_string(number + 1);
}

}  // namespace

Result<DownstreamTrials> make_downstream_trials(const FabricLibrary& library,
                                                const DownstreamCampaign& campaign,
                                                const DownstreamLevel& level, std::uint64_t seed) {
  DownstreamTrials out;
  const std::size_t all = library.fabrics.size();
  const std::size_t fabrics = campaign.fabrics > 0 ? std::min(campaign.fabrics, all) : all;
  for (std::size_t f = 0; f < fabrics; ++f) {
    const Fabric& fabric = library.fabrics[f];
    for (std::size_t s = 0; s < campaign.swatches; ++s)
      for (std::size_t t = 0; t < campaign.trials; ++t) {
        const std::uint64_t swatch = mix(mix(seed, "swatch"), s);
        const auto patch = make_patch(fabric, library, swatch, mix(swatch, t + 1));
        if (!patch) return pass(patch.error(), fabric.name);
        Exploration trial(level, *patch, mix(seed, "rig"));
        trial.run(campaign.slide_s);
        out.pads.push_back(std::move(trial).pads());
        out.force.push_back(std::move(trial).force());
        name(out.pads.back(), fabric.name, s, t);
        name(out.force.back(), fabric.name, s, t);
      }
  }
  return out;
}

}  // namespace weft::daemon
