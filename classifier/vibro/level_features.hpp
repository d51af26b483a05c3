#pragma once
// Sums over the samples of a window, eight side by side.

#include <cstddef>
#include <span>

namespace weft::classifier::vibro {

/// A sample whose magnitude is not above this has no sign: librosa's threshold.
inline constexpr double zero_level = 1e-10;

/// Eight running sums: fast, and nearer to the true sum than one.
double sum_of(std::span<const double> values);
/// Of (value - middle)^2, likewise.
double sum_of_squares(std::span<const double> values, double middle = 0.0);
/// How many values are negative, below -zero_level, where the one before is not, or the other way
/// round. The first has none before it.
std::size_t changes_of_sign(std::span<const double> values);
/// |value - middle| of each, to `out`, which holds as many.
void deviations(std::span<const double> values, double middle, double* out);

}  // namespace weft::classifier::vibro
