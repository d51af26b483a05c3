#pragma once
// What librosa 0.10 weighs spectra with: pitch classes and the ear.

#include <cstddef>
#include <vector>

namespace weft::classifier::vibro {

inline constexpr std::size_t pitch_classes = 12;

/// Weights [12 x bins] of the power in every bin for every pitch class, C first, of a transform of
/// `length` samples at `rate_hz`: librosa.filters.chroma with its defaults and no tuning (S5).
std::vector<double> chroma_weights(double rate_hz, std::size_t length);

/// A-weighting (IEC 61672-1) of every bin in dB, not below -80: librosa.A_weighting.
std::vector<double> a_weighting_db(double rate_hz, std::size_t length);

}  // namespace weft::classifier::vibro
