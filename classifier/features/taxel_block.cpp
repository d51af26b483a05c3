#include "classifier/features/taxel_block.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

using simd::all;
using simd::Lanes;
using simd::lanes_of;
using simd::load;
using simd::store;

using PerTaxel = TaxelBlock::PerTaxel;
constexpr std::size_t taxels = TaxelBlock::taxels;
// Signals of a block that works on V: real and imaginary ones of its transforms.
template <class V>
inline constexpr std::size_t row_of = 2 * lanes_of<V>;

// A relative variance that is only rounding: 0.1 repeated has 2e-34.
constexpr double constant_tolerance = 1e-24;
constexpr double fewest_peaks = 3.0;       // for a skewness
constexpr std::size_t fewest_samples = 4;  // for a kurtosis

// Whether the signal falls here after it last rose, so that the value before was a strict local
// maximum: a flat top counts once, end points never (as MATLAB's findpeaks). Updates `rising`, 1 or
// 0.
template <class V>
WEFT_INLINE V is_peak(V value, V last, V& rising) {
  const V peak = value < last ? rising : all<V>(0.0);
  rising = value > last ? all<V>(1.0) : rising - peak;
  return peak;
}

template <class V>
WEFT_INLINE void update_with(const double* rows, std::size_t count, TaxelBlock::Running& running) {
  for (std::size_t k = 0; k < row_of<V>; k += lanes_of<V>) {
    V low = load<V>(&running.low[k]), high = load<V>(&running.high[k]);
    V sum = load<V>(&running.sum[k]), square = load<V>(&running.square[k]);
    V last = load<V>(&running.last[k]), rising = load<V>(&running.rising[k]);
    V peaks = load<V>(&running.peaks[k]), peak_sum = load<V>(&running.peak_sum[k]);
    const double* row = rows + k;
    for (std::size_t i = 0; i < count; ++i, row += row_of<V>) {
      const V v = load<V>(row);
      low = simd::smaller(v, low);
      high = simd::larger(v, high);
      sum += v;
      square += v * v;
      const V peak = is_peak(v, last, rising);
      peaks += peak;
      peak_sum += peak > 0.0 ? last : all<V>(0.0);
      last = v;
    }
    store(&running.low[k], low), store(&running.high[k], high);
    store(&running.sum[k], sum), store(&running.square[k], square);
    store(&running.last[k], last), store(&running.rising[k], rising);
    store(&running.peaks[k], peaks), store(&running.peak_sum[k], peak_sum);
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void update_sixteen(const double* rows, std::size_t count, TaxelBlock::Running& running) {
  update_with<Lanes>(rows, count, running);
}
void update_two(const double* rows, std::size_t count, TaxelBlock::Running& running) {
  update_with<double>(rows, count, running);
}

void start(const double* row, std::size_t width, TaxelBlock::Running& running) {
  running = {};
  for (PerTaxel* first : {&running.low, &running.high, &running.last})
    std::copy(row, row + width, first->begin());
}

// Sums of powers about the mean: of the signal, and of its peaks about theirs.
struct Powers {
  alignas(64) PerTaxel mean{}, second{}, third{}, fourth{}, fifth{};
  alignas(64) PerTaxel peak_mean{}, peak_second{}, peak_third{};
};

template <class V>
WEFT_INLINE void add_powers_with(const double* rows, std::size_t count, Powers& out) {
  for (std::size_t k = 0; k < row_of<V>; k += lanes_of<V>) {
    const V mean = load<V>(&out.mean[k]), peak_mean = load<V>(&out.peak_mean[k]);
    V s2 = all<V>(0.0), s3 = s2, s4 = s2, s5 = s2, p2 = s2, p3 = s2, rising = s2;
    V last = load<V>(rows + k);
    const double* row = rows + k;
    for (std::size_t i = 0; i < count; ++i, row += row_of<V>) {
      const V v = load<V>(row), c = v - mean, c2 = c * c;
      s2 += c2;
      s3 += c2 * c;
      s4 += c2 * c2;
      s5 += c2 * c2 * c;
      const V p = is_peak(v, last, rising) > 0.0 ? last - peak_mean : all<V>(0.0);
      p2 += p * p;
      p3 += p * p * p;
      last = v;
    }
    store(&out.second[k], s2), store(&out.third[k], s3), store(&out.fourth[k], s4);
    store(&out.fifth[k], s5), store(&out.peak_second[k], p2), store(&out.peak_third[k], p3);
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_powers_sixteen(const double* rows, std::size_t count, Powers& out) {
  add_powers_with<Lanes>(rows, count, out);
}
void add_powers_two(const double* rows, std::size_t count, Powers& out) {
  add_powers_with<double>(rows, count, out);
}

bool varies(double variance, double mean) {
  return variance > constant_tolerance * std::max(1.0, mean * mean);
}

// Biased m3 / m2^1.5; 0 for a constant.
double skewness(double second, double third, double count, double mean) {
  const double m2 = second / count;
  return varies(m2, mean) ? third / count / (m2 * std::sqrt(m2)) : 0.0;
}

Powers powers_of(const double* rows, std::size_t width, std::size_t samples,
                 const TaxelBlock::Running& running) {
  Powers out;
  for (std::size_t k = 0; k < taxels; ++k) {
    out.mean[k] = running.sum[k] / static_cast<double>(samples);
    out.peak_mean[k] = running.peaks[k] > 0.0 ? running.peak_sum[k] / running.peaks[k] : 0.0;
  }
  width == taxels ? add_powers_sixteen(rows, samples, out) : add_powers_two(rows, samples, out);
  return out;
}

// Largest magnitude without DC, and the sum of the upper half: bins floor(K/2)+1 .. K, K =
// floor(T/2).
template <class V>
WEFT_INLINE void summarise_with(const double* bins, std::size_t top, double scale,
                                PerTaxel& largest, PerTaxel& upper) {
  for (std::size_t k = 0; k < row_of<V>; k += lanes_of<V>) {
    V most = all<V>(0.0), sum = most;
    for (std::size_t b = 1; b <= top; ++b) {
      const V v = load<V>(bins + b * row_of<V> + k);
      most = simd::larger(v, most);
      if (b > top / 2) sum += v;
    }
    store(&largest[k], most * scale);
    store(&upper[k], sum * scale);
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void summarise_sixteen(const double* bins, std::size_t top, double scale, PerTaxel& largest,
                       PerTaxel& upper) {
  summarise_with<Lanes>(bins, top, scale, largest, upper);
}
void summarise_two(const double* bins, std::size_t top, double scale, PerTaxel& largest,
                   PerTaxel& upper) {
  summarise_with<double>(bins, top, scale, largest, upper);
}

PerTaxel& at(TaxelBlock::Features& features, Block block) {
  const auto* found = std::find(taxel_blocks.begin(), taxel_blocks.end(), block);
  return features[static_cast<std::size_t>(found - taxel_blocks.begin())];
}

}  // namespace

TaxelBlock::TaxelBlock(std::size_t used)
    : used_(used), width_(used <= row_of<double> ? row_of<double> : row_of<Lanes>) {}

void TaxelBlock::grow(std::size_t samples) {
  if (rows_.size() >= samples * width_) return;
  rows_.resize(std::max(samples * width_, 2 * rows_.size()), 0.0);
}

void TaxelBlock::add(const double* counts, std::size_t stride, std::size_t count) {
  if (count == 0) return;
  grow(samples_ + count);
  double* const first = rows_.data() + samples_ * width_;
  for (std::size_t i = 0; i < count; ++i) {
    double* const end = std::copy_n(counts + i * stride, used_, first + i * width_);
    std::fill(end, first + (i + 1) * width_, 0.0);
  }
  if (samples_ == 0) start(first, width_, running_);
  narrow() ? update_two(first, count, running_) : update_sixteen(first, count, running_);
  samples_ += count;
}

TaxelBlock::Features TaxelBlock::features(const FeatureOptions& options, BlockTools& tools) const {
  const auto n = static_cast<double>(samples_);
  const Powers p = powers_of(rows_.data(), width_, samples_, running_);
  Features out{};
  at(out, Block::max) = running_.high;
  at(out, Block::min) = running_.low;
  at(out, Block::mean) = p.mean;
  at(out, Block::mode) = tools.modes.find(rows_.data(), width_, samples_, running_.low,
                                          running_.high, options.mode_bin_counts);
  const Spectrum& spectrum = tools.spectra.of(samples_);
  const double scale = options.spectrum == SpectrumScale::amplitude ? 2.0 / n : 1.0;
  PerTaxel &hfrq = at(out, Block::hfrq), &sh = at(out, Block::sh);
  if (narrow()) {
    const double* const bins =
        spectrum.magnitudes<double>(rows_.data(), p.mean.data(), tools.transform);
    summarise_two(bins, samples_ / 2, scale, hfrq, sh);
  } else {
    const double* const bins =
        spectrum.magnitudes<Lanes>(rows_.data(), p.mean.data(), tools.transform);
    summarise_sixteen(bins, samples_ / 2, scale, hfrq, sh);
  }
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
    if (!moves) hfrq[k] = sh[k] = 0.0;  // rounding is no spectrum
  }
  return out;
}

}  // namespace weft::classifier
