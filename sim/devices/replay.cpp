#include "sim/devices/replay.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace

Replayed replay(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion) {
  Plant plant(params, rig_seed);
  plant.mount(motion.patch, motion.mounted, motion.mounted_at);
  Replayed out;
  GridPoint point = motion.first;
  TimePoint before = motion.mounted_at;
  for (const Pose& pose : motion.poses) {
    const TimePoint now = point.time();
    plant.advance(pose, to_seconds(now - before));
    before = now;
    if (point.ends_frame()) {
      out.normal_n.push_back(plant.contact().normal_n);
      out.friction_n.push_back(plant.contact().friction_n);
      out.counts.push_back(plant.pad_counts());
    } else {
      plant.convert(point.stage, point.frame);
    }
    point.advance();
  }
  return out;
}

RunError difference(const Replayed& run, const Replayed& finer) {
  Tally force, friction, counts;
  const std::size_t frames = std::min(run.normal_n.size(), finer.normal_n.size());
  for (std::size_t i = 0; i < frames; ++i) {
    if (!(run.normal_n[i] > 0 || finer.normal_n[i] > 0)) continue;
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
          .counts_rms = counts.rms()};
}

std::vector<RunError> run_errors(const PlantParams& params, std::uint64_t rig_seed,
                                 const BenchMotion& motion) {
  const FidelitySetting setting = setting_of(params);
  const Replayed run = replay(params, rig_seed, motion);
  std::vector<RunError> out;
  for (const FidelitySetting& finer : finer_than(setting)) {
    PlantParams reference = params;
    apply(finer, reference);
    out.push_back(difference(run, replay(reference, rig_seed, motion)));
    out.back().setting = to_string(setting);
    out.back().reference = to_string(finer);
  }
  return out;
}

}  // namespace weft::sim
