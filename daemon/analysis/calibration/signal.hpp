#pragma once
// Estimators on one signal. Moments use two passes; for finite samples no result is NaN.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace weft::daemon::calibration {

using Samples = std::span<const double>;

double mean(Samples values);      ///< 0 if empty
double variance(Samples values);  ///< mean square about the mean; 0 if empty
/// Sample standard deviation (n - 1); nothing for fewer than two values.
std::optional<double> sample_sd(Samples values);
/// Interpolates linearly between order statistics; nothing if empty. `share` 0 to 1.
std::optional<double> quantile(std::vector<double> values, double share);
std::optional<double> median(std::vector<double> values);

double slope(Samples values);  ///< of the least-squares line, per sample
std::vector<double> without_line(Samples values);
/// -1 to 1; 0 if one of them is constant. Equal lengths.
double correlation(Samples a, Samples b);

/// Standard deviation of white noise on a smooth signal: sqrt(mean (third difference)^2 / 20).
double noise_sd(Samples values);
/// Share of first differences further than 5 robust sd (IQR / 1.349) from their median; 0 if the
/// IQR is 0.
double jump_share(Samples values);

/// Edges of the bands of the spectrum [1/mm].
constexpr std::array band_edges_per_mm{0.01, 0.03, 0.1, 0.3, 1.0, 1.75};
constexpr std::size_t bands = band_edges_per_mm.size() - 1;
/// [channel][band] rms under a Hann window, for signals of equal length. A band that the signal
/// cannot contain (a wave longer than the signal, or beyond Nyquist) is absent in all channels.
std::vector<std::array<std::optional<double>, bands>> band_rms(
    const std::vector<std::vector<double>>& channels, double pitch_mm);

/// n^2 = s0^2 + k1 L + k2 L^2 by least squares, no coefficient negative.
struct NoiseLaw {
  double s0 = 0, k1 = 0, k2 = 0;
};
/// Nothing for fewer than 3 points or equal levels.
std::optional<NoiseLaw> fit_noise_law(Samples level, Samples noise);
/// d ln n / d ln L by least squares, over points with both > 0; nothing as above.
std::optional<double> fit_exponent(Samples level, Samples noise);

}  // namespace weft::daemon::calibration
