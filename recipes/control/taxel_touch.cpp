#include "recipes/control/taxel_touch.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace weft::recipes {

void TaxelTouch::begin() {
  std::ranges::fill(baseline_, 0.0);
  frames_ = 0;
  mean_change_ = largest_change_ = 0;
  settled_ = false;
}

void TaxelTouch::settle() {
  for (double& sum : baseline_) sum /= static_cast<double>(frames_);
  settled_ = true;
}

void TaxelTouch::gather(std::span<const std::uint16_t> counts) {
  for (std::size_t i = 0; i < counts.size(); ++i) baseline_[i] += counts[i];
  const double mean =
      std::accumulate(counts.begin(), counts.end(), 0.0) / static_cast<double>(counts.size());
  least_ = frames_ == 0 ? mean : std::min(least_, mean);
  most_ = frames_ == 0 ? mean : std::max(most_, mean);
  ++frames_;
}

void TaxelTouch::add(std::span<const std::uint16_t> counts) {
  constexpr std::uint16_t full_scale = 0xFFFF;
  if (counts.empty()) return;
  if (counts.size() != baseline_.size()) {
    baseline_.assign(counts.size(), 0);
    begin();
  }
  if (!settled_) return gather(counts);
  double sum = 0, largest = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double change = counts[i] - baseline_[i];
    sum += change;
    largest = std::max(largest, counts[i] == full_scale ? full_scale : std::abs(change));
  }
  mean_change_ = std::abs(sum) / static_cast<double>(counts.size());
  largest_change_ = largest;
}

}  // namespace weft::recipes
