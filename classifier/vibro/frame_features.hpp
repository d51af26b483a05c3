#pragma once
// What is read from the spectra of sixteen frames at once.

#include <array>
#include <cstddef>
#include <span>

#include "classifier/vibro/short_time.hpp"

namespace weft::classifier::vibro {

// Sums over the samples of a window, eight side by side.

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

struct FrameFeatures {
  PerFrame centroid_hz{};   ///< mean frequency, weighted by the magnitude; 0 of a silent frame
  PerFrame bandwidth_hz{};  ///< deviation about it, weighted so; 0 of a silent frame
  PerFrame rolloff_hz{};    ///< lowest frequency with 85 % of the magnitudes at or below it
  PerFrame chroma{};        ///< mean over the classes of their power over the largest class's
  PerFrame decibels{};      ///< sum over the bins of 10 log10(max(power, least_power))
  std::array<bool, frame_lanes> silent{};  ///< not one magnitude above 0
};

/// `magnitudes` [bins x 16] with their `sums`, by the tables of which they were made;
/// `least_power` > 0. Decibels are products of mantissas and sums of exponents, so that hardly a
/// logarithm is taken.
FrameFeatures frame_features(const double* magnitudes, const BinSums& sums, const BinTables& tables,
                             double least_power);

}  // namespace weft::classifier::vibro
