#include "daemon/analysis/calibration/variance_components.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace weft::daemon::calibration {
namespace {

using Key = std::array<std::size_t, nested_levels>;  // entries beyond the level are 0

struct Group {
  double members = 0;
  std::vector<double> mean;
  /// For each finer level, the sum of the squared sizes of its groups inside this group.
  std::array<double, nested_levels> squares{};
};

using Level = std::map<Key, Group>;

Key cut(Key key, std::size_t level) {
  std::fill(key.begin() + static_cast<std::ptrdiff_t>(level) + 1, key.end(), 0);
  return key;
}

Level group_by(const std::vector<NestedValue>& observations, std::size_t level) {
  Level out;
  for (const NestedValue& one : observations) {
    Group& group = out[cut(one.group, level)];
    group.mean.resize(one.values.size());
    group.members += 1;
    for (std::size_t c = 0; c < one.values.size(); ++c) group.mean[c] += one.values[c];
  }
  for (auto& [key, group] : out)
    for (double& m : group.mean) m /= group.members;
  return out;
}

double square_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t c = 0; c < a.size(); ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return a.empty() ? 0 : sum / static_cast<double>(a.size());
}

/// Sum of squares of the means of `level` about those of the next wider level; uses observations at
/// the last level.
double sum_of_squares(const std::array<Level, nested_levels>& levels,
                      const std::vector<NestedValue>& observations, std::size_t level) {
  double sum = 0;
  if (level == nested_levels)
    for (const NestedValue& one : observations)
      sum += square_distance(one.values, levels[nested_levels - 1].at(one.group).mean);
  else
    for (const auto& [key, group] : levels[level])
      sum += group.members *
             square_distance(group.mean, levels[level - 1].at(cut(key, level - 1)).mean);
  return sum;
}

/// Weight of the variance of level `of` in the expected T of level `in` (sum over groups of members
/// x mean^2); `of` must not be wider than `in`.
double weight(const std::array<Level, nested_levels>& levels, std::size_t in, std::size_t of) {
  double sum = 0;
  for (const auto& [key, group] : levels[in])
    sum += of == nested_levels ? 1 : group.squares[of] / group.members;
  return sum;
}

std::array<Level, nested_levels> make_levels(const std::vector<NestedValue>& observations) {
  std::array<Level, nested_levels> levels;
  for (std::size_t k = 0; k < nested_levels; ++k) levels[k] = group_by(observations, k);
  for (std::size_t fine = 0; fine < nested_levels; ++fine)
    for (const auto& [key, group] : levels[fine])
      for (std::size_t wide = 0; wide <= fine; ++wide)
        levels[wide].at(cut(key, wide)).squares[fine] += group.members * group.members;
  return levels;
}

}  // namespace

NestedSpread nested_spread(const std::vector<NestedValue>& observations) {
  const auto levels = make_levels(observations);
  const auto in_total = [&](std::size_t in, std::size_t of) {
    return in == nested_levels ? static_cast<double>(observations.size()) : weight(levels, in, of);
  };
  // Starts with the finest level: each level's sum of squares contains the variances of finer
  // levels.
  std::array<std::optional<double>, nested_levels + 1> variance;
  for (std::size_t level = nested_levels; level > 0; --level) {
    const auto share = [&](std::size_t of) {
      return in_total(level, of) - in_total(level - 1, of);
    };
    double rest = sum_of_squares(levels, observations, level);
    for (std::size_t fine = level + 1; fine <= nested_levels; ++fine)
      rest -= share(fine) * variance[fine].value_or(0);
    if (share(level) > 1e-9) variance[level] = std::max(0.0, rest / share(level));
  }
  const auto sd = [](std::optional<double> square) {
    return square ? std::optional(std::sqrt(*square)) : std::nullopt;
  };
  return {sd(variance[1]), sd(variance[2]), sd(variance[3])};
}

}  // namespace weft::daemon::calibration
