#pragma once
// What is read from the spectra of sixteen frames at once.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/vibro/short_time.hpp"

namespace weft::classifier::vibro {

/// Weights of the bins of one transform length and rate.
struct BinTables {
  BinTables(double rate_hz, std::size_t length);

  std::size_t bins = 0;
  std::vector<double> frequency_hz;  ///< [bins]
  std::vector<double> chroma;        ///< [bins x 12], a row per bin
  double mean_a_weighting_db = 0.0;
};

/// A figure per frame.
using PerFrame = std::array<double, ShortTimeSpectrum::lanes>;

struct FrameFigures {
  PerFrame centroid_hz{};   ///< mean frequency, weighted by the magnitude; 0 of a silent frame
  PerFrame bandwidth_hz{};  ///< deviation about it, weighted so; 0 of a silent frame
  PerFrame rolloff_hz{};    ///< lowest frequency with 85 % of the magnitudes at or below it
  PerFrame chroma{};        ///< mean over the classes of their power over the largest class's
  PerFrame loudest{};       ///< largest power of a bin
  std::array<bool, ShortTimeSpectrum::lanes> silent{};  ///< not one magnitude above 0
};

/// `magnitudes` [bins x 16]. With `chroma` false that figure is left 0: it costs the most.
FrameFigures frame_figures(const double* magnitudes, const BinTables& tables, bool chroma);

/// Per frame the sum over the bins of 10 log10(max(power, least_power)); `least_power` > 0.
/// Products of mantissas and sums of exponents, so that hardly a logarithm is taken.
PerFrame sum_of_decibels(const double* magnitudes, std::size_t bins, double least_power);

}  // namespace weft::classifier::vibro
