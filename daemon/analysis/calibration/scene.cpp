#include "daemon/analysis/calibration/scene.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "daemon/analysis/calibration/press.hpp"
#include "protocols/base/time.hpp"
#include "sim/plant/plant.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double sample_s = 1e-9 * static_cast<double>(sim::pad_timing::frame_ns);
constexpr double conversion_s = 1e-9 * static_cast<double>(sim::pad_timing::stage_ns);
constexpr double most_settling = 8;  // limits the scaled settling time, because work grows with the
                                     // samples
constexpr double settling_s = 10;    // under load, before a stroke
constexpr double slack_m = 20e-3;    // the probe rests in the middle of this range
constexpr double patch_m = 20e-3;    // between paths of one mounting; wider than the face
constexpr std::size_t rest_scans = 15, press_scans = 20;
constexpr double lead_s = 0.5;  // start of the stroke, which a view leaves out

/// Scales the plant's times to samples of the recording.
void scale_times(ClothModel::Inputs& inputs, double ratio) {
  inputs.pads.creep_time_s *= ratio;
  inputs.pads.drift_time_s *= ratio;
  inputs.pads.common_mode_time_s *= ratio;
  for (double& time_s : inputs.params.relaxation_time_s) time_s *= ratio;
}

/// One sensor on one mounted piece.
class Stylus {
 public:
  Stylus(const sim::PlantParams& params, std::uint64_t seed, const sim::Plant* textured,
         double time_ratio)
      : plant_(params, seed),
        grip_n_m_(params.mount.stiffness_n_m),
        settling_s_(settling_s * std::clamp(time_ratio, 1.0, most_settling)) {
    if (textured != nullptr) plant_.share_tiles(*textured);
  }

  using Counts = std::array<std::uint16_t, sim::pad_count>;

  /// Puts the probe on the fabric, loaded by its own weight.
  void rest(const sim::Patch& patch, double x_m) {
    sim::PlantMemory memory = plant_.memory();
    memory.contact = {};  // the fabric has recovered; the state of pads and dose is kept
    pose_ = {.x_m = x_m, .z_m = -patch.material.thickness_m - slack_m / 2};
    plant_.mount(patch, pose_, {}, touched_ ? &memory : nullptr);
    touched_ = true;
  }
  void press_to(double force_n, double rest_n) {
    pose_.z_m = plant_.contact_now().probe_z_m() + (force_n - rest_n) / grip_n_m_;
    approach(force_n);
    plant_.advance(pose_, settling_s_);
    approach(force_n);
  }
  /// One sample, after the probe has moved by `dy_m`.
  const Counts& scan(double dy_m) {
    const sim::Pose from = pose_;
    pose_.y_m += dy_m;
    for (int stage = 0; stage < sim::pad_timing::stages; ++stage) {
      plant_.advance(sim::between(from, pose_, (stage + 1) * conversion_s / sample_s),
                     conversion_s);
      plant_.convert(stage, frame_);
    }
    plant_.advance(pose_, sample_s - sim::pad_timing::stages * conversion_s);
    ++frame_;
    return plant_.pad_counts();
  }
  [[nodiscard]] double force_n() const { return plant_.contact_now().normal_n; }
  [[nodiscard]] const sim::Plant& plant() const { return plant_; }

 private:
  /// The fabric deforms too, so each step is too short, never too long.
  void approach(double force_n) {
    for (std::size_t i = 0; i < press_scans; ++i) {
      scan(0);
      pose_.z_m += (force_n - plant_.contact_now().normal_n) / grip_n_m_;
    }
  }

  sim::Plant plant_;
  double grip_n_m_, settling_s_;
  sim::Pose pose_;
  std::uint64_t frame_ = 0;
  bool touched_ = false;
};

/// One stroke, starting with the probe on the fabric; channels as in the view.
Stroke slide_once(Stylus& stylus, const Stroke& like, const std::vector<std::size_t>& pads,
                  double force_n, double rest_n, double scale) {
  Stroke out = like;
  std::vector<double> idle(pads.size(), 0);
  for (std::size_t i = 0; i < rest_scans; ++i) {
    const Stylus::Counts& counts = stylus.scan(0);
    for (std::size_t c = 0; c < pads.size(); ++c)
      idle[c] += static_cast<double>(counts[pads[c]]) / static_cast<double>(rest_scans);
  }
  stylus.press_to(force_n, rest_n);
  const double dy_m = like.speed_mps / like.rate_hz;
  for (auto lead = std::lround(lead_s * like.rate_hz); lead > 0; --lead) stylus.scan(dy_m);
  for (std::size_t i = 0; i < like.samples(); ++i) {
    const Stylus::Counts& counts = stylus.scan(dy_m);
    for (std::size_t c = 0; c < pads.size(); ++c)
      out.counts[c][i] = scale * (static_cast<double>(counts[pads[c]]) - idle[c]);
  }
  for (std::size_t c = 0; c < pads.size(); ++c) {
    double sum = 0;
    for (const double x : out.counts[c]) sum += x;
    out.level[c] = sum / static_cast<double>(like.samples());
  }
  out.force_n = std::isnan(like.force_n) ? like.force_n : stylus.force_n();
  return out;
}

/// Calls work(0) to work(count - 1), each once.
template <class Work>
void run_all(std::size_t count, std::size_t threads, const Work& work) {
  std::atomic<std::size_t> next{0};
  const auto take = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < std::min(threads, count); ++i) others.emplace_back(take);
  take();
}

}  // namespace

Result<Scene> Scene::make(const RecordingView& like, const ClothModel& model) {
  if (like.recorded.empty() || like.recorded.back() >= sim::pad_count)
    return fail({.code = Errc::unsupported,
                 .where = "recordings",
                 .what = "more channels than the simulated array",
                 .expected = "at most " + std::to_string(sim::pad_count),
                 .got = std::to_string(like.recorded_channels)});
  Scene out(like, model);
  for (std::size_t i = 0; i < like.strokes.size(); ++i) {
    const Stroke& stroke = like.strokes[i];
    const auto same = [&](const Job& job) {
      return job.group.cloth == stroke.cloth && job.group.mounting == stroke.mounting &&
             job.group.rate_hz == stroke.rate_hz;
    };
    auto job = std::ranges::find_if(out.jobs_, same);
    if (job == out.jobs_.end())
      job = out.jobs_.insert(job, Job{{stroke.cloth, stroke.mounting, stroke.rate_hz, {}}, {}, {}});
    job->group.strokes.push_back(i);
  }
  return out;
}

/// The parameters of the group's fabric and the common ones; others do not affect the group.
std::vector<double> Scene::values_of(const SceneGroup& group,
                                     std::span<const double> values) const {
  std::vector<double> out;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string& cloth = model_->parameters()[i].cloth;
    if (cloth.empty() || cloth == group.cloth) out.push_back(values[i]);
  }
  return out;
}

Status Scene::make_group(Job& job, std::span<const double> values, std::uint64_t seed) const {
  std::vector<double> own = values_of(job.group, values);
  const auto is_made = [&](const Made& made) {
    return !made.strokes.empty() && made.seed == seed && made.values == own;
  };
  if (is_made(job.made[0])) return {};
  std::swap(job.made[0], job.made[1]);
  if (is_made(job.made[0])) return {};
  auto strokes = slide(job, values, seed);
  if (!strokes) return pass(strokes.error(), job.group.cloth);
  job.made[0] = {std::move(own), seed, std::move(*strokes)};
  return {};
}

namespace {

/// The plant's pads for the recorded channels: channels of a square array keep their neighbours.
std::vector<std::size_t> pads_of(const RecordingView& like) {
  constexpr std::size_t pads_a_row = 4;
  std::size_t side = 1;
  while (side * side < like.recorded_channels) ++side;
  std::vector<std::size_t> out = like.recorded;
  if (side * side == like.recorded_channels && side <= pads_a_row)
    for (std::size_t& channel : out) channel = channel / side * pads_a_row + channel % side;
  return out;
}

}  // namespace

Scene::Textured Scene::texture_of(const SceneGroup& group, std::span<const double> values,
                                  std::uint64_t seed) const {
  Textured out{{values[model_->find("cover_um")]}, seed, nullptr};
  for (const std::string_view name : {"height_um", "band_low_per_mm", "line_share"})
    if (const std::size_t at = model_->find(name, group.cloth); at < values.size())
      out.values.push_back(values[at]);
  return out;
}

Result<std::vector<Stroke>> Scene::slide(Job& job, std::span<const double> values,
                                         std::uint64_t seed) const {
  const SceneGroup& group = job.group;
  Textured textured = texture_of(group, values, seed);
  if (job.textured.values == textured.values && job.textured.seed == seed)
    textured.plant = job.textured.plant;
  ClothModel::Inputs inputs = model_->inputs(group.cloth, values);
  std::vector<const Stroke*> strokes;
  for (const std::size_t i : group.strokes) strokes.push_back(&like_.strokes[i]);
  const Press press = plan_press(strokes, inputs.pads, model_->scale());
  scale_times(inputs, group.rate_hz * sample_s);
  sim::PlantParams params;
  params.quasistatic_step_s = sample_s;
  params.pads = inputs.pads;
  params.cover = inputs.params.cover;
  params.mount = {.mass_kg = press.rest_n / standard_gravity_mps2,
                  .stiffness_n_m = inputs.grip_n_m,
                  .slack_m = slack_m};
  const std::uint64_t rig = sim::mix(seed, "rig");
  std::optional<Stylus> stylus;
  std::vector<Stroke> out;
  for (const std::size_t i : group.strokes) {
    const Stroke& like = like_.strokes[i];
    const sim::PatchSeeds seeds{
        sim::mix(seed, "piece"), sim::mix(sim::mix(seed, "mounting"), group.mounting),
        sim::mix(sim::mix(sim::mix(seed, "touch"), like.cell), like.repetition)};
    const auto patch = sim::cut_patch(inputs.fabric, inputs.params, inputs.spread, {}, seeds);
    if (!patch) return pass(patch.error());
    if (!stylus) {
      if (Status ok = sim::check(params, patch->material); !ok) return pass(ok.error());
      stylus.emplace(params, rig, textured.plant.get(), group.rate_hz * sample_s);
    }
    stylus->rest(*patch, patch_m * like.patch);
    out.push_back(slide_once(*stylus, like, pads_of(like_), press.force_n[out.size()], press.rest_n,
                             model_->scale()));
  }
  textured.plant = std::make_shared<const sim::Plant>(stylus->plant());
  job.textured = std::move(textured);
  return out;
}

Result<RecordingView> Scene::simulate(std::span<const double> values, std::uint64_t seed,
                                      std::size_t threads) {
  std::vector<Status> done(jobs_.size());
  run_all(jobs_.size(), threads,
          [&](std::size_t i) { done[i] = make_group(jobs_[i], values, seed); });
  RecordingView out = like_;
  out.remarks.clear();
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    if (!done[j]) return pass(done[j].error());
    const SceneGroup& group = jobs_[j].group;
    for (std::size_t k = 0; k < group.strokes.size(); ++k)
      out.strokes[group.strokes[k]] = jobs_[j].made[0].strokes[k];
  }
  return out;
}

}  // namespace weft::daemon::calibration
