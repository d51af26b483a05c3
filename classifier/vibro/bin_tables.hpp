#pragma once
// Weights of the bins of a short-time spectrum.

#include <array>
#include <cstddef>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {

// Weights of spectra in librosa 0.10: pitch classes and the A-weighting of the ear.

inline constexpr std::size_t pitch_classes = 12;

/// Weights [12 x bins] of the power in every bin for every pitch class, C first, for a transform of
/// `length` samples at `rate_hz`: librosa.filters.chroma with its defaults and no tuning (S5).
std::vector<double> chroma_weights(double rate_hz, std::size_t length);

/// A-weighting (IEC 61672-1) of every bin in dB, not below -80: librosa.A_weighting.
std::vector<double> a_weighting_db(double rate_hz, std::size_t length);

/// Frames processed side by side.
inline constexpr std::size_t frame_lanes = simd::block_taxels;
/// One value per frame.
using PerFrame = std::array<double, frame_lanes>;

/// Number of pitch classes that a bin contributes to, except for the lowest bins: those nearest to
/// its pitch. Any other class would get less than 1e-13 of the weight of the bin's own class.
inline constexpr std::size_t near_classes = 8;

/// Neighbouring bins with the same near classes.
struct ClassRun {
  std::size_t first_bin, end_bin;
  std::size_t first_class;  ///< 0 to 11; the other near classes follow it around the circle
};

/// Tables of one transform length and rate.
struct BinTables {
  BinTables(double rate_hz, std::size_t length);

  std::size_t bins = 0;
  std::vector<double> frequency_hz;  ///< [bins]
  std::size_t wide_bins = 0;         ///< the lowest bins; they are a semitone wide or wider
  std::vector<double> wide_chroma;   ///< [wide_bins x 12], a row per bin
  std::vector<double> near_chroma;   ///< [bins - wide_bins x 8], a row per bin
  std::vector<ClassRun> runs;        ///< of the other bins, in order
  double mean_a_weighting_db = 0.0;
};

}  // namespace weft::classifier::vibro
