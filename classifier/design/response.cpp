#include "classifier/design/response.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "classifier/features/spectrum.hpp"

namespace weft::classifier::design {
namespace {

constexpr std::size_t least_press = 3, least_motion = 8;
constexpr double rounding_counts2 = 1.0 / 12;

std::vector<std::size_t> samples_of(const Trial& trial, Phase phase) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < trial.samples(); ++i)
    if (trial.phase[i] == phase) out.push_back(i);
  return out;
}

std::vector<double> extract_signal(const Trial& trial, const std::vector<std::size_t>& rows,
                                   std::size_t taxel) {
  std::vector<double> out;
  out.reserve(rows.size());
  for (const std::size_t r : rows) out.push_back(trial.row(r)[taxel]);
  return out;
}

double noise_variance(const std::vector<double>& x) {
  double sum = 0;
  for (std::size_t i = 1; i < x.size(); ++i) sum += (x[i] - x[i - 1]) * (x[i] - x[i - 1]);
  return std::max(rounding_counts2, sum / (2.0 * static_cast<double>(x.size() - 1)));
}

/// Subtracts the least-squares line: relaxation must not count as texture.
void remove_line(std::vector<double>& x) {
  const auto n = static_cast<double>(x.size());
  const double middle = (n - 1) / 2;
  double mean = 0, slope = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean += x[i] / n;
    slope += (static_cast<double>(i) - middle) * x[i];
  }
  slope /= n * (n * n - 1) / 12;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] -= mean + slope * (static_cast<double>(i) - middle);
}

struct Bins {
  std::size_t first = 1, last = 0;
  [[nodiscard]] std::size_t count() const { return last + 1 - first; }
};

/// Sum over the bins of 2 |X|^2 / n^2: a sinusoid of amplitude A has A^2 / 2.
double band_power(const Spectrum& spectrum, std::vector<double> x, const Bins& bins,
                  simd::AlignedDoubles& scratch) {
  remove_line(x);
  const std::size_t n = x.size();
  std::vector<double> rows(2 * n, 0.0);  // two signals side by side; the second is zero
  double largest[2] = {0, 0};
  for (std::size_t i = 0; i < n; ++i) {
    rows[2 * i] = x[i];
    largest[0] = std::max(largest[0], std::abs(x[i]));
  }
  const double offset[2] = {0, 0};
  const double* magnitude = spectrum.magnitudes<double>(rows.data(), offset, largest, scratch);
  double power = 0;
  for (std::size_t k = bins.first; k <= bins.last; ++k) {
    const double twice = 2 * k == n ? 1 : 2;  // the bin at half the rate has no mirror image
    power += twice * magnitude[2 * k] * magnitude[2 * k];
  }
  return power / (static_cast<double>(n) * static_cast<double>(n));
}

}  // namespace

Result<Response> response_of(const Trial& trial, double rate_hz, double speed_mps, double lowest,
                             double highest, const TextureBand& band) {
  const auto press = samples_of(trial, Phase::press), motion = samples_of(trial, Phase::motion);
  if (press.size() < least_press || motion.size() < least_motion)
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "too few samples to separate signal from noise",
                 .expected = "at least 3 in phase P and 8 in phase M",
                 .got = std::to_string(press.size()) + " and " + std::to_string(motion.size())});
  if (!(rate_hz > 0) || !(speed_mps > 0))
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "sample rate or speed not known"});
  Response out;
  out.low_hz = speed_mps / band.longest_m;
  out.high_hz = std::min(speed_mps / band.shortest_m, rate_hz / 2);
  const double bin_hz = rate_hz / static_cast<double>(motion.size());
  Bins bins;
  bins.first = std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(out.low_hz / bin_hz)));
  bins.last = std::min(motion.size() / 2, static_cast<std::size_t>(out.high_hz / bin_hz));
  if (bins.last < bins.first)
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "sample rate or duration too low to resolve the texture band"});
  const Spectrum spectrum(motion.size());
  simd::AlignedDoubles scratch;
  std::size_t saturated = 0;
  const auto taxels = static_cast<double>(trial.taxels);
  // A bin of white noise of variance v has a power of 2 v / n.
  const double share = 2 * static_cast<double>(bins.count()) / static_cast<double>(motion.size());
  for (std::size_t taxel = 0; taxel < trial.taxels; ++taxel) {
    const std::vector<double> moving = extract_signal(trial, motion, taxel);
    saturated += static_cast<std::size_t>(std::ranges::count_if(
        moving, [&](double value) { return value <= lowest || value >= highest; }));
    out.signal_counts2 += band_power(spectrum, moving, bins, scratch) / taxels;
    out.noise_counts2 += share * noise_variance(extract_signal(trial, press, taxel)) / taxels;
  }
  // A zero signal counts as one far below the noise.
  out.snr_db = 10 * std::log10(std::max(out.signal_counts2 / out.noise_counts2, 1e-6));
  out.saturated_share =
      static_cast<double>(saturated) / (taxels * static_cast<double>(motion.size()));
  return out;
}

}  // namespace weft::classifier::design
