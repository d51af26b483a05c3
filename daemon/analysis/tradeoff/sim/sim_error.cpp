#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/base/text/format.hpp"
#include "sim/plant/modal/rubbing.hpp"

namespace weft::daemon {

namespace {

constexpr double absurd_ratio = 10;       // of the largest force of the reference
constexpr double least_amplitude = 0.5;   // of a stick-slip cycle, else it is lost
constexpr double cycle_tolerance = 0.10;  // of its amplitude and frequency, else it is wrong

constexpr std::uint64_t rubbing_seed = 1;

class Deviations {
 public:
  void add(double square) {
    most_ = std::max(most_, square);
    sum_ += square;
    ++count_;
  }
  [[nodiscard]] SimDeviation result() const {
    return {std::sqrt(most_),
            std::sqrt(sum_ / static_cast<double>(std::max<std::size_t>(count_, 1)))};
  }

 private:
  double most_ = 0, sum_ = 0;
  std::size_t count_ = 0;
};

double square(double x) {
  return x * x;
}

SimDeviation pad_deviation(const SimTrace& run, const SimTrace& reference) {
  Deviations out;
  for (std::size_t i = 0; i < run.pads.size(); ++i)
    for (std::size_t pad = 0; pad < sim::pad_count; ++pad)
      out.add(square(static_cast<double>(run.pads[i][pad]) - reference.pads[i][pad]));
  return out.result();
}

std::string newtons(double n) {
  return general(n) + " N";
}

std::string cycle_failure(const SimCycle& run, const SimCycle& reference) {
  const double ratio = run.peak_to_peak_n / reference.peak_to_peak_n;
  if (!(ratio >= least_amplitude) || !(run.frequency_hz > 0))
    return "stick-slip lost: " + newtons(run.peak_to_peak_n) + " peak to peak instead of " +
           newtons(reference.peak_to_peak_n);
  if (std::abs(ratio - 1) > cycle_tolerance ||
      std::abs(run.frequency_hz / reference.frequency_hz - 1) > cycle_tolerance)
    return "stick-slip wrong: " + newtons(run.peak_to_peak_n) + " at " +
           fixed(run.frequency_hz, 1) + " Hz instead of " + newtons(reference.peak_to_peak_n) +
           " at " + fixed(reference.frequency_hz, 1) + " Hz";
  return {};
}

}  // namespace

SimError measure_error(const SimTrace& run, const SimTrace& reference) {
  Deviations force, normal;
  const std::size_t count = std::min(run.samples.size(), reference.samples.size());
  for (std::size_t i = 0; i < count; ++i) {
    const sim::ContactState &a = run.samples[i], &b = reference.samples[i];
    const double across =
        square(a.friction_n[0] - b.friction_n[0]) + square(a.friction_n[1] - b.friction_n[1]);
    normal.add(square(a.normal_n - b.normal_n));
    force.add(square(a.normal_n - b.normal_n) + across);
  }
  SimError out{force.result(), normal.result(), {}, {}};
  if (!run.pads.empty() && run.pads.size() == reference.pads.size())
    out.pads = pad_deviation(run, reference);
  if (run.touch_s.empty() || run.touch_s.size() != reference.touch_s.size()) return out;
  out.touch_s = 0;
  for (std::size_t i = 0; i < run.touch_s.size(); ++i)
    out.touch_s = std::max(*out.touch_s, std::abs(run.touch_s[i] - reference.touch_s[i]));
  return out;
}

Result<SimDeviation> rubbing_force(const SimCase& one, const SimTrace& run) {
  const sim::Patch& patch = one.patch;
  auto rubbing = sim::Rubbing::make({}, patch.field, rubbing_seed, patch.skew_rad);
  if (!rubbing) return pass(rubbing.error(), one.name);
  Deviations out;
  for (const sim::ContactState& s : run.samples) {
    const double lambda_m = patch.material.law.lambda_m;
    const sim::Force force = rubbing->advance(
        {{s.face_x_m(), s.face_y_m()}, s.friction_n, s.normal_n, s.normal_n / lambda_m});
    out.add(one.slides ? square(force[0] - s.friction_n[0]) + square(force[1] - s.friction_n[1]) +
                             square(force[2] - s.normal_n)
                       : 0);
  }
  return out.result();
}

std::string find_failure(const SimCase& one, const SimTrace& run, const SimTrace& reference) {
  double largest_n = 0, worst_n = 0;
  for (std::size_t i = 0; i < run.samples.size(); ++i) {
    const sim::ContactState& a = run.samples[i];
    if (!std::isfinite(a.normal_n) || !std::isfinite(a.friction_n[1]))
      return "a force that is no number at " + fixed(sim_sample_s * static_cast<double>(i + 1), 3) +
             " s";
    largest_n = std::max(largest_n, reference.samples[i].normal_n);
    worst_n = std::max(worst_n, std::abs(a.normal_n - reference.samples[i].normal_n));
  }
  if (worst_n > absurd_ratio * largest_n) return "diverged: " + newtons(worst_n) + " off";
  if (one.cycle_to_s > 0) return cycle_failure(run.cycle, reference.cycle);
  if (run.touch_s.size() < reference.touch_s.size())
    return "touch-downs: " + std::to_string(run.touch_s.size()) + " of " +
           std::to_string(reference.touch_s.size());
  return {};
}

}  // namespace weft::daemon
