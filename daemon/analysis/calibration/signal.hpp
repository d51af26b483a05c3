#pragma once
// Estimators on one signal. Moments take two passes; nothing returns NaN for finite samples.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace weft::daemon::calibration {

using Samples = std::span<const double>;

double mean(Samples values);      ///< 0 of none
double variance(Samples values);  ///< mean square about the mean; 0 of none
/// Of a sample, n - 1; nothing of fewer than two.
std::optional<double> sample_sd(Samples values);
/// Between order statistics, linearly; nothing of none. `share` 0 to 1.
std::optional<double> quantile(std::vector<double> values, double share);
std::optional<double> median(std::vector<double> values);

double slope(Samples values);  ///< of the least-squares line, a sample
std::vector<double> without_line(Samples values);
/// -1 to 1; 0 where one of them is constant. Equal lengths.
double correlation(Samples a, Samples b);

/// Standard deviation of white noise below a smooth signal: sqrt(mean (third difference)^2 / 20).
double noise_sd(Samples values);
/// Share of first differences further than 5 robust sd (IQR / 1.349) from their median; 0 where
/// the IQR is 0.
double jump_share(Samples values);

/// Edges of the bands of the spectrum [1/mm].
constexpr std::array band_edges_per_mm{0.01, 0.03, 0.1, 0.3, 1.0, 1.75};
constexpr std::size_t bands = band_edges_per_mm.size() - 1;
/// [channel][band] rms under a Hann window, of signals of equal length; a band that the signal does
/// not hold (a wave longer than it, or beyond Nyquist) is absent of all of them.
std::vector<std::array<std::optional<double>, bands>> band_rms(
    const std::vector<std::vector<double>>& channels, double pitch_mm);

/// n^2 = s0^2 + k1 L + k2 L^2 by least squares, none negative.
struct NoiseLaw {
  double s0 = 0, k1 = 0, k2 = 0;
};
/// Nothing of fewer than 3 points or where the levels are all alike.
std::optional<NoiseLaw> fit_noise_law(Samples level, Samples noise);
/// d ln n / d ln L by least squares, of points where both are > 0; nothing as above.
std::optional<double> fit_exponent(Samples level, Samples noise);

}  // namespace weft::daemon::calibration
