#include "sim/devices/replay.hpp"

#include <algorithm>
#include <cmath>

#include "sim/plant/fidelity/reference.hpp"

namespace weft::sim {

namespace {

/// A force that is not finite is infinitely far from any other.
double distance(double difference) {
  return std::isfinite(difference) ? std::abs(difference) : HUGE_VAL;
}

/// Largest difference and sum of squares.
struct Tally {
  double largest = 0, squares = 0;
  std::size_t count = 0;

  void add(double difference) {
    const double size = distance(difference);
    largest = std::max(largest, size);
    squares += size * size;
    ++count;
  }
  [[nodiscard]] double rms() const {
    return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
  }
};

constexpr double loop_share = 1.02;  // of the weight: set points of a force loop are above it

/// Leads the z stage so that the force follows that of the run.
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
  /// Called at the end of frame number `index` of the replay.
  void sample(std::size_t index, double normal_n) {
    if (run_ == nullptr) return;
    const double wanted_n = run_->normal_n[std::min(index, run_->normal_n.size() - 1)];
    // A force loop is active when the mount pushes; otherwise a stage follows its commands.
    speed_mps_ =
        wanted_n > weight_n_ ? mps_per_n_ * (wanted_n - normal_n) : -offset_m_ / lead_time_s;
  }

 private:
  const Replayed* run_;
  double mps_per_n_, weight_n_, speed_mps_ = 0, offset_m_ = 0;
};

constexpr std::int64_t points_per_frame = pad_timing::stages + 1;

/// Number since time zero.
std::int64_t number_of(const GridPoint& point) {
  return static_cast<std::int64_t>(point.frame) * points_per_frame + point.stage;
}

Replayed play(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
              const Replayed* run, const std::vector<std::size_t>& points) {
  Plant plant(params, rig_seed);
  plant.mount(motion.patch, motion.mounted, motion.mounted_at,
              motion.memory ? &*motion.memory : nullptr);
  Lead lead(params.mount, run);
  Replayed out;
  GridPoint point = motion.first;
  TimePoint before = motion.mounted_at;
  auto wanted = points.begin();
  std::size_t index = 0;
  for (const Pose& pose : motion.poses) {
    const TimePoint now = point.time();
    const double dt_s = to_seconds(now - before);
    plant.advance(lead.led(pose, dt_s), dt_s);
    before = now;
    for (; wanted != points.end() && *wanted == index; ++wanted)
      out.wrench_n.push_back(plant.contact_now().normal_n);
    ++index;
    if (point.ends_frame()) {
      const ContactState contact = plant.contact_now();
      out.normal_n.push_back(contact.normal_n);
      out.friction_n.push_back(contact.friction_n);
      if (params.watched.pads) out.counts.push_back(plant.pad_counts());
      lead.sample(out.normal_n.size() - 1, out.normal_n.back());
    } else {
      plant.convert(point.stage, point.frame);
    }
    point.advance();
  }
  return out;
}

}  // namespace

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

std::vector<std::size_t> wrench_points(const BenchMotion& motion,
                                       const std::vector<TimePoint>& sampled) {
  std::vector<std::size_t> out;
  const auto poses = static_cast<std::int64_t>(motion.poses.size());
  for (const TimePoint at : sampled) {
    const std::int64_t frame = ns_of(at) / pad_timing::frame_ns;
    const std::int64_t in_frame = (ns_of(at) % pad_timing::frame_ns) / pad_timing::stage_ns;
    const std::int64_t passed =
        frame * points_per_frame + std::min<std::int64_t>(in_frame, pad_timing::stages);
    const std::int64_t last = passed - 1 - number_of(motion.first);
    if (last >= 0 && last < poses) out.push_back(static_cast<std::size_t>(last));
  }
  return out;
}

Replayed replay(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                const std::vector<std::size_t>& points) {
  return play(params, rig_seed, motion, nullptr, points);
}

Replayed replay_led(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                    const Replayed& run, const std::vector<std::size_t>& points) {
  return play(params, rig_seed, motion, &run, points);
}

RunError difference(const Replayed& run, const Replayed& finer, const std::vector<bool>& counted) {
  Tally anywhere, force, friction, counts;
  const std::size_t frames = std::min(run.normal_n.size(), finer.normal_n.size());
  const bool pads = frames > 0 && run.counts.size() >= frames && finer.counts.size() >= frames;
  for (std::size_t i = 0; i < frames; ++i) {
    if (run.normal_n[i] <= 0 && finer.normal_n[i] <= 0) continue;  // NaN counts as contact
    anywhere.add(run.normal_n[i] - finer.normal_n[i]);
    if (i < counted.size() && !counted[i]) continue;
    force.add(run.normal_n[i] - finer.normal_n[i]);
    friction.add(std::hypot(run.friction_n[i][0] - finer.friction_n[i][0],
                            run.friction_n[i][1] - finer.friction_n[i][1]));
    for (std::size_t pad = 0; pads && pad < pad_count; ++pad)
      counts.add(static_cast<double>(run.counts[i][pad]) - finer.counts[i][pad]);
  }
  for (std::size_t i = 0; i < std::min(run.wrench_n.size(), finer.wrench_n.size()); ++i) {
    if (run.wrench_n[i] <= 0 && finer.wrench_n[i] <= 0) continue;
    anywhere.add(run.wrench_n[i] - finer.wrench_n[i]);
    force.add(run.wrench_n[i] - finer.wrench_n[i]);
  }
  RunError out;
  out.samples = force.count;
  out.force_max_n = force.largest;
  out.force_rms_n = force.rms();
  out.friction_max_n = friction.largest;
  out.friction_rms_n = friction.rms();
  out.pads = pads;
  out.counts_max = counts.largest;
  out.counts_rms = counts.rms();
  out.anywhere_max_n = anywhere.largest;
  return out;
}

namespace {

/// One motion with the data that all its replays share.
class Comparison {
 public:
  Comparison(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
             const SampleTimes& sampled)
      : params_(params),
        seed_(rig_seed),
        motion_(motion),
        setting_(setting_of(params)),
        points_(wrench_points(motion, sampled.wrench)),
        run_(replay(params, rig_seed, motion, points_)),
        counted_(counted_frames(motion, run_.normal_n.size(), sampled.pads)) {}

  [[nodiscard]] const FidelitySetting& setting() const { return setting_; }
  [[nodiscard]] Replayed led(const Reference& reference) const {
    return setting_.level > Level::algebraic
               ? replay_led(with(reference), seed_, motion_, run_, points_)
               : replay(with(reference), seed_, motion_, points_);
  }
  [[nodiscard]] RunError against(const Reference& reference, const Replayed& led) const {
    RunError out = difference(run_, led, counted_);
    out.setting = to_string(setting_);
    out.reference = to_string(reference.setting());
    out.worst_at = worst_at(led);
    const RunError unled =
        difference(run_, replay(with(reference), seed_, motion_, points_), counted_);
    out.unled_max_n = unled.force_max_n;
    out.unled_rms_n = unled.force_rms_n;
    return out;
  }
  [[nodiscard]] double largest_n(const Replayed& a, const Replayed& b) const {
    return difference(a, b, counted_).force_max_n;
  }
  [[nodiscard]] double largest_n(const Replayed& led) const { return largest_n(run_, led); }
  /// Time of the largest difference.
  [[nodiscard]] TimePoint worst_at(const Replayed& led) const {
    double worst_n = -1;
    GridPoint worst{motion_.first.frame, pad_timing::stages};
    const auto see = [&](double off_n, const GridPoint& where) {
      if (off_n <= worst_n) return;
      worst_n = off_n;
      worst = where;
    };
    for (std::size_t i = 0; i < std::min(run_.normal_n.size(), led.normal_n.size()); ++i)
      if (counts(i))
        see(distance(run_.normal_n[i] - led.normal_n[i]),
            {motion_.first.frame + i, pad_timing::stages});
    for (std::size_t i = 0; i < std::min(run_.wrench_n.size(), led.wrench_n.size()); ++i)
      see(distance(run_.wrench_n[i] - led.wrench_n[i]), point_at(points_[i]));
    return worst.time();
  }

 private:
  [[nodiscard]] PlantParams with(const Reference& reference) const {
    PlantParams out = params_;
    apply(reference.setting(), out);
    out.watched.pads = false;
    return out;
  }
  [[nodiscard]] bool counts(std::size_t frame) const {
    return frame >= counted_.size() || counted_[frame];
  }
  [[nodiscard]] GridPoint point_at(std::size_t pose) const {
    const std::int64_t number = number_of(motion_.first) + static_cast<std::int64_t>(pose);
    return {static_cast<std::uint64_t>(number / points_per_frame),
            static_cast<int>(number % points_per_frame)};
  }

  const PlantParams& params_;
  std::uint64_t seed_;
  const BenchMotion& motion_;
  FidelitySetting setting_;
  std::vector<std::size_t> points_;  ///< samples of the force sensor
  Replayed run_;
  std::vector<bool> counted_;
};

RunError doubled_error(const Comparison& comparison, double accuracy_n) {
  for (int halvings = 0;; ++halvings) {
    const Reference first = first_reference(comparison.setting(), halvings);
    const Reference second = second_reference(first);
    const Replayed by_first = comparison.led(first), by_second = comparison.led(second);
    const double uncertainty_n = comparison.largest_n(by_first, by_second);
    const bool agree = uncertainty_n <= trusted_share * accuracy_n;
    const bool surely_above = comparison.largest_n(by_first) > accuracy_n + uncertainty_n;
    if (!agree && !surely_above && halvings < most_halvings) continue;
    RunError out = comparison.against(first, by_first);
    out.is_doubled = true;
    // Either reference may be right: the error is that against the further one.
    if (const double second_n = comparison.largest_n(by_second); second_n > out.force_max_n) {
      out.force_max_n = second_n;
      out.worst_at = comparison.worst_at(by_second);
    }
    out.uncertainty_n = uncertainty_n;
    out.is_resolved = agree || surely_above;
    return out;
  }
}

}  // namespace

RunError run_error(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                   const SampleTimes& sampled, std::optional<double> accuracy_n) {
  const Comparison comparison(params, rig_seed, motion, sampled);
  if (accuracy_n) return doubled_error(comparison, *accuracy_n);
  const Reference quick = quick_reference(comparison.setting());
  return comparison.against(quick, comparison.led(quick));
}

}  // namespace weft::sim
