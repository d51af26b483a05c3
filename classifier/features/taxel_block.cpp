#include "classifier/features/taxel_block.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

using simd::all;
using simd::Lanes;
using simd::load;
using simd::store;
using simd::width;

using PerTaxel = TaxelBlock::PerTaxel;
constexpr std::size_t taxels = TaxelBlock::taxels;

// A relative variance that is only rounding: 0.1 repeated has 2e-34.
constexpr double constant_tolerance = 1e-24;
constexpr double fewest_peaks = 3.0;       // for a skewness
constexpr std::size_t fewest_samples = 4;  // for a kurtosis

// Whether the signal falls here after it last rose, so that the value before was a strict local
// maximum: a flat top counts once, end points never (as MATLAB's findpeaks). Updates `rising`, 1 or
// 0.
WEFT_INLINE Lanes is_peak(Lanes value, Lanes last, Lanes& rising) {
  const Lanes peak = value < last ? rising : all(0.0);
  rising = value > last ? all(1.0) : rising - peak;
  return peak;
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void update(const double* rows, std::size_t count, TaxelBlock::Running& running) {
  for (std::size_t k = 0; k < taxels; k += width) {
    Lanes low = load(&running.low[k]), high = load(&running.high[k]);
    Lanes sum = load(&running.sum[k]), square = load(&running.square[k]);
    Lanes last = load(&running.last[k]), rising = load(&running.rising[k]);
    Lanes peaks = load(&running.peaks[k]), peak_sum = load(&running.peak_sum[k]);
    for (const double *row = rows + k, *end = row + count * taxels; row != end; row += taxels) {
      const Lanes v = load(row);
      low = simd::smaller(v, low);
      high = simd::larger(v, high);
      sum += v;
      square += v * v;
      const Lanes peak = is_peak(v, last, rising);
      peaks += peak;
      peak_sum += peak > 0.0 ? last : all(0.0);
      last = v;
    }
    store(&running.low[k], low), store(&running.high[k], high);
    store(&running.sum[k], sum), store(&running.square[k], square);
    store(&running.last[k], last), store(&running.rising[k], rising);
    store(&running.peaks[k], peaks), store(&running.peak_sum[k], peak_sum);
  }
}

void start(const double* row, TaxelBlock::Running& running) {
  running = {};
  for (PerTaxel* first : {&running.low, &running.high, &running.last})
    std::copy(row, row + taxels, first->begin());
}

// Sums of powers about the mean: of the signal, and of its peaks about theirs.
struct Powers {
  alignas(64) PerTaxel mean{}, second{}, third{}, fourth{}, fifth{};
  alignas(64) PerTaxel peak_mean{}, peak_second{}, peak_third{};
};

WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_powers(const double* rows, std::size_t count, Powers& out) {
  for (std::size_t k = 0; k < taxels; k += width) {
    const Lanes mean = load(&out.mean[k]), peak_mean = load(&out.peak_mean[k]);
    Lanes s2 = all(0.0), s3 = s2, s4 = s2, s5 = s2, p2 = s2, p3 = s2, rising = s2;
    Lanes last = load(rows + k);
    for (const double *row = rows + k, *end = row + count * taxels; row != end; row += taxels) {
      const Lanes v = load(row), c = v - mean, c2 = c * c;
      s2 += c2;
      s3 += c2 * c;
      s4 += c2 * c2;
      s5 += c2 * c2 * c;
      const Lanes p = is_peak(v, last, rising) > 0.0 ? last - peak_mean : all(0.0);
      p2 += p * p;
      p3 += p * p * p;
      last = v;
    }
    store(&out.second[k], s2), store(&out.third[k], s3), store(&out.fourth[k], s4);
    store(&out.fifth[k], s5), store(&out.peak_second[k], p2), store(&out.peak_third[k], p3);
  }
}

bool varies(double variance, double mean) {
  return variance > constant_tolerance * std::max(1.0, mean * mean);
}

// Biased m3 / m2^1.5; 0 for a constant.
double skewness(double second, double third, double count, double mean) {
  const double m2 = second / count;
  return varies(m2, mean) ? third / count / (m2 * std::sqrt(m2)) : 0.0;
}

Powers powers_of(const double* rows, std::size_t samples, const TaxelBlock::Running& running) {
  Powers out;
  for (std::size_t k = 0; k < taxels; ++k) {
    out.mean[k] = running.sum[k] / static_cast<double>(samples);
    out.peak_mean[k] = running.peaks[k] > 0.0 ? running.peak_sum[k] / running.peaks[k] : 0.0;
  }
  add_powers(rows, samples, out);
  return out;
}

// Largest magnitude without DC, and the sum of the upper half: bins floor(K/2)+1 .. K, K =
// floor(T/2).
WEFT_CLONES("arch=x86-64-v4", "avx2")
void summarise(const double* bins, std::size_t top, double scale, PerTaxel& largest,
               PerTaxel& upper) {
  for (std::size_t k = 0; k < taxels; k += width) {
    Lanes most = all(0.0), sum = all(0.0);
    for (std::size_t b = 1; b <= top; ++b) {
      const Lanes v = load(bins + b * taxels + k);
      most = simd::larger(v, most);
      if (b > top / 2) sum += v;
    }
    store(&largest[k], most * scale);
    store(&upper[k], sum * scale);
  }
}

PerTaxel& at(TaxelBlock::Features& features, Block block) {
  const auto* found = std::find(taxel_blocks.begin(), taxel_blocks.end(), block);
  return features[static_cast<std::size_t>(found - taxel_blocks.begin())];
}

}  // namespace

void TaxelBlock::grow(std::size_t samples) {
  if (rows_.size() >= samples * taxels) return;
  rows_.resize(std::max(samples * taxels, 2 * rows_.size()), 0.0);
}

void TaxelBlock::add(const double* counts, std::size_t used, std::size_t stride,
                     std::size_t count) {
  if (count == 0) return;
  grow(samples_ + count);
  double* const first = rows_.data() + samples_ * taxels;
  for (std::size_t i = 0; i < count; ++i) {
    double* const end = std::copy_n(counts + i * stride, used, first + i * taxels);
    std::fill(end, first + (i + 1) * taxels, 0.0);
  }
  if (samples_ == 0) start(first, running_);
  update(first, count, running_);
  samples_ += count;
}

TaxelBlock::Features TaxelBlock::features(const FeatureOptions& options, BlockTools& tools) const {
  const auto n = static_cast<double>(samples_);
  const Powers p = powers_of(rows_.data(), samples_, running_);
  Features out{};
  at(out, Block::max) = running_.high;
  at(out, Block::min) = running_.low;
  at(out, Block::mean) = p.mean;
  at(out, Block::mode) = tools.modes.find(rows_.data(), samples_, running_.low, running_.high,
                                          options.mode_bin_counts);
  const Spectrum& spectrum = tools.spectra.of(samples_);
  const double* const bins =
      spectrum.magnitudes<Lanes>(rows_.data(), p.mean.data(), tools.transform);
  const double scale = options.spectrum == SpectrumScale::amplitude ? 2.0 / n : 1.0;
  summarise(bins, samples_ / 2, scale, at(out, Block::hfrq), at(out, Block::sh));
  for (std::size_t k = 0; k < taxels; ++k) {
    const double m2 = p.second[k] / n;
    const bool moves = varies(m2, p.mean[k]);
    const double square = options.norm == Norm::rms ? running_.square[k] / n : running_.square[k];
    at(out, Block::norm)[k] = std::sqrt(square);
    at(out, Block::range)[k] = running_.high[k] - running_.low[k];
    at(out, Block::var)[k] = moves && samples_ > 1 ? m2 * n / (n - 1.0) : 0.0;
    at(out, Block::kurt)[k] =
        moves && samples_ >= fewest_samples ? p.fourth[k] / n / (m2 * m2) : 3.0;
    at(out, Block::m5)[k] = moves ? p.fifth[k] / n : 0.0;
    if (options.skew == SkewOf::signal) {
      at(out, Block::skew)[k] =
          n >= fewest_peaks ? skewness(p.second[k], p.third[k], n, p.mean[k]) : 0.0;
    } else if (running_.peaks[k] >= fewest_peaks) {
      at(out, Block::skew)[k] =
          skewness(p.peak_second[k], p.peak_third[k], running_.peaks[k], p.peak_mean[k]);
    }
    if (!moves) at(out, Block::hfrq)[k] = at(out, Block::sh)[k] = 0.0;  // rounding is no spectrum
  }
  return out;
}

}  // namespace weft::classifier
