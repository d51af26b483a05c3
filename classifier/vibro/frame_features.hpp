#pragma once
// What is read from the spectra of sixteen frames at once.

#include <array>

#include "classifier/vibro/short_time.hpp"

namespace weft::classifier::vibro {

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
