#include "sim/devices/replay.hpp"

#include <algorithm>
#include <cmath>

#include "sim/plant/fidelity/table.hpp"

namespace weft::sim {

namespace {

/// Largest and mean square of differences.
struct Tally {
  double largest = 0, squares = 0;
  std::size_t count = 0;

  void add(double difference) {
    largest = std::max(largest, std::abs(difference));
    squares += difference * difference;
    ++count;
  }
  [[nodiscard]] double rms() const {
    return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
  }
};

constexpr double loop_share = 1.02;  // of the weight: a loop's set points are above it

/// What leads the z stage.
class Lead {
 public:
  Lead(const Mount& mount, const Replayed* run)
      : run_(run),
        mps_per_n_(1 / (mount.stiffness_n_m * lead_time_s)),
        weight_n_(loop_share * mount.weight_n()) {}

  Pose led(Pose pose, double dt_s) {
    offset_m_ += speed_mps_ * dt_s;
    pose.z_m += offset_m_;
    return pose;
  }
  /// At the end of frame number `index` of the replay.
  void sample(std::size_t index, double normal_n) {
    if (run_ == nullptr) return;
    const double wanted_n = run_->normal_n[std::min(index, run_->normal_n.size() - 1)];
    // A force loop is at work where the mount pushes; without it a stage goes where it is sent.
    speed_mps_ =
        wanted_n > weight_n_ ? mps_per_n_ * (wanted_n - normal_n) : -offset_m_ / lead_time_s;
  }

 private:
  const Replayed* run_;
  double mps_per_n_, weight_n_, speed_mps_ = 0, offset_m_ = 0;
};

Replayed play(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
              const Replayed* run) {
  Plant plant(params, rig_seed);
  plant.mount(motion.patch, motion.mounted, motion.mounted_at,
              motion.memory ? &*motion.memory : nullptr);
  Lead lead(params.mount, run);
  Replayed out;
  GridPoint point = motion.first;
  TimePoint before = motion.mounted_at;
  for (const Pose& pose : motion.poses) {
    const TimePoint now = point.time();
    const double dt_s = to_seconds(now - before);
    plant.advance(lead.led(pose, dt_s), dt_s);
    before = now;
    if (point.ends_frame()) {
      const ContactState contact = plant.contact_now();
      out.normal_n.push_back(contact.normal_n);
      out.friction_n.push_back(contact.friction_n);
      out.counts.push_back(plant.pad_counts());
      lead.sample(out.normal_n.size() - 1, out.normal_n.back());
    } else {
      plant.convert(point.stage, point.frame);
    }
    point.advance();
  }
  return out;
}

std::vector<bool> counted_frames(const BenchMotion& motion, std::size_t frames,
                                 const std::vector<TimePoint>& sampled) {
  if (sampled.empty()) return {};
  std::vector<bool> counted(frames, false);
  const auto first = static_cast<std::int64_t>(motion.first.frame);
  for (const TimePoint at : sampled) {
    const std::int64_t ended = ns_of(at) / pad_timing::frame_ns - 1 - first;
    if (ended >= 0 && ended < static_cast<std::int64_t>(frames))
      counted[static_cast<std::size_t>(ended)] = true;
  }
  return counted;
}

}  // namespace

Replayed replay(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion) {
  return play(params, rig_seed, motion, nullptr);
}

Replayed replay_led(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                    const Replayed& run) {
  return play(params, rig_seed, motion, &run);
}

RunError difference(const Replayed& run, const Replayed& finer, const std::vector<bool>& counted) {
  Tally anywhere, force, friction, counts;
  const std::size_t frames = std::min(run.normal_n.size(), finer.normal_n.size());
  for (std::size_t i = 0; i < frames; ++i) {
    if (!(run.normal_n[i] > 0 || finer.normal_n[i] > 0)) continue;
    anywhere.add(run.normal_n[i] - finer.normal_n[i]);
    if (i < counted.size() && !counted[i]) continue;
    force.add(run.normal_n[i] - finer.normal_n[i]);
    friction.add(std::hypot(run.friction_n[i][0] - finer.friction_n[i][0],
                            run.friction_n[i][1] - finer.friction_n[i][1]));
    for (std::size_t pad = 0; pad < pad_count; ++pad)
      counts.add(static_cast<double>(run.counts[i][pad]) - finer.counts[i][pad]);
  }
  return {.setting = {},
          .reference = {},
          .samples = force.count,
          .force_max_n = force.largest,
          .force_rms_n = force.rms(),
          .friction_max_n = friction.largest,
          .friction_rms_n = friction.rms(),
          .counts_max = counts.largest,
          .counts_rms = counts.rms(),
          .anywhere_max_n = anywhere.largest,
          .unled_max_n = 0,
          .unled_rms_n = 0};
}

std::vector<RunError> run_errors(const PlantParams& params, std::uint64_t rig_seed,
                                 const BenchMotion& motion, const std::vector<TimePoint>& sampled) {
  const FidelitySetting setting = setting_of(params);
  const Replayed run = replay(params, rig_seed, motion);
  const std::vector<bool> counted = counted_frames(motion, run.normal_n.size(), sampled);
  std::vector<RunError> out;
  for (const FidelitySetting& finer : finer_than(setting)) {
    PlantParams reference = params;
    apply(finer, reference);
    const bool leads = setting.level > Level::algebraic;
    RunError error = difference(
        run,
        leads ? replay_led(reference, rig_seed, motion, run) : replay(reference, rig_seed, motion),
        counted);
    reference.watched.pads = false;  // of these the force alone is looked at
    const RunError unled = difference(run, replay(reference, rig_seed, motion), counted);
    error.unled_max_n = unled.force_max_n;
    error.unled_rms_n = unled.force_rms_n;
    error.pads = params.watched.pads;
    error.setting = to_string(setting);
    error.reference = to_string(finer);
    out.push_back(error);
  }
  return out;
}

}  // namespace weft::sim
