#include "recipes/control/force_latency.hpp"

#include <algorithm>
#include <cmath>

namespace weft::recipes {
namespace {

constexpr double least_motion_m = 20e-6;  // over the whole memory; more than ten steps of a stage
constexpr std::size_t least_changes = 64;

struct Sums {
  double zz = 0, ff = 0, zf = 0;
};

}  // namespace

ForceLatency::ForceLatency(double cycle_s)
    : cycle_s_(cycle_s), capacity_(static_cast<std::size_t>(std::lround(memory_s / cycle_s))) {
  values_.reserve(capacity_);
}

void ForceLatency::add(double z_m, double force_n) {
  if (values_.size() < capacity_) return values_.push_back({z_m, force_n});
  values_[next_] = {z_m, force_n};
  next_ = (next_ + 1) % capacity_;
}

std::vector<ForceLatency::Pair> ForceLatency::changes() const {
  std::vector<Pair> out;
  for (std::size_t i = 1; i < values_.size(); ++i) {
    const Pair& before = values_[(next_ + i - 1) % values_.size()];
    const Pair& after = values_[(next_ + i) % values_.size()];
    out.push_back({after.z_m - before.z_m, after.force_n - before.force_n});
  }
  return out;
}

std::optional<double> ForceLatency::estimate_s() const {
  const std::vector<Pair> change = changes();
  const auto longest = static_cast<std::size_t>(std::lround(longest_s / cycle_s_));
  if (change.size() < longest + least_changes) return std::nullopt;
  double way_m = 0;
  for (const Pair& one : change) way_m += std::abs(one.z_m);
  if (way_m < least_motion_m) return std::nullopt;
  double best = 0;
  std::size_t lag = 0;
  for (std::size_t k = 0; k <= longest; ++k) {
    Sums sums;
    for (std::size_t i = longest; i < change.size(); ++i) {
      const double z = change[i - k].z_m, f = change[i].force_n;
      sums.zz += z * z;
      sums.ff += f * f;
      sums.zf += z * f;
    }
    const double correlation = sums.zf / std::sqrt(std::max(sums.zz * sums.ff, 1e-300));
    if (correlation <= best) continue;
    best = correlation;
    lag = k;
  }
  if (best < least_correlation) return std::nullopt;
  return static_cast<double>(lag) * cycle_s_;
}

}  // namespace weft::recipes
