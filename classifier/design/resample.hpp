#pragma once
// Resampling with replacement (Efron 1979), the same with every compiler.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/base/random.hpp"

namespace weft::classifier::design {

/// `count` numbers below `count`, with replacement; count > 0.
std::vector<std::size_t> resampled(std::size_t count, RandomEngine& engine);

/// Standard normal (Box and Muller 1958).
double normal_draw(RandomEngine& engine);

/// Value below which `share` (0 to 1) of `values` lies, between neighbours in proportion. At least
/// one value; they are sorted.
double quantile(std::vector<double> values, double share);

/// The middle 95 % of the means of `draws` resamples; a single value has no interval but itself.
Interval mean_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed);

/// The same of their median.
Interval median_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed);

}  // namespace weft::classifier::design
