#include "classifier/features/taxel_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "classifier/features/powers.hpp"

namespace weft::classifier {
namespace {

using simd::all;
using simd::Lanes;
using simd::lanes_of;
using simd::load;
using simd::store;

using PerTaxel = TaxelBlock::PerTaxel;
constexpr std::size_t taxels = TaxelBlock::taxels;
// Number of signals of a block that works on V: the real and imaginary ones of its transforms.
template <class V>
inline constexpr std::size_t row_of = 2 * lanes_of<V>;

// Up to this variance, relative to the square of the largest value, there is only rounding:
// deviations of less than two units in the last place.
constexpr double constant_tolerance = 4.0 * 0x1p-52 * 0x1p-52;
// Between these limits powers of deviations are normal numbers once the signal is scaled.
constexpr double tiny_range = 0x1p-200, least_range = 0x1p-960;
constexpr double fewest_samples = 4.0;      // least number for a kurtosis
constexpr double kurtosis_of_normal = 3.0;  // also used for a constant signal

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

// Means of the signal and of its peaks; 0 without peaks.
template <class V>
WEFT_INLINE void set_means_with(const TaxelBlock::Running& running, double n, Powers& out) {
  for (std::size_t k = 0; k < row_of<V>; k += lanes_of<V>) {
    const V peaks = load<V>(&running.peaks[k]), of_peaks = load<V>(&running.peak_sum[k]) / peaks;
    store(&out.mean[k], load<V>(&running.sum[k]) / n);
    store(&out.peak_mean[k], peaks > 0.0 ? of_peaks : all<V>(0.0));
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void set_means_sixteen(const TaxelBlock::Running& running, double n, Powers& out) {
  set_means_with<Lanes>(running, n, out);
}

Powers powers_of(const double* rows, std::size_t width, std::size_t samples,
                 const TaxelBlock::Running& running) {
  Powers out;
  const auto n = static_cast<double>(samples);
  if (width == taxels) {
    set_means_sixteen(running, n, out);
    add_powers_sixteen(rows, samples, out);
  } else {
    set_means_with<double>(running, n, out);
    add_powers_two(rows, samples, out);
  }
  refine_where_needed(rows, width, samples, running, out);
  return out;
}

template <Block block>
PerTaxel& at(TaxelBlock::Features& features) {
  constexpr auto* found = std::find(taxel_blocks.begin(), taxel_blocks.end(), block);
  return features[static_cast<std::size_t>(found - taxel_blocks.begin())];
}

// Limit that a variance must exceed; below it the spread is rounding. Infinite for a constant, as
// its mean may be rounded.
template <class V>
WEFT_INLINE V rounding_of(V low, V high) {
  const V largest = simd::larger(simd::magnitude(low), simd::magnitude(high));
  const V limit = constant_tolerance * largest * largest;
  return high > low ? limit : all<V>(std::numeric_limits<double>::infinity());
}

// Biased m3 / m2^1.5 of `count` values; 0 for a constant and for fewer than three. `root` is that
// of m2.
template <class V>
WEFT_INLINE V skewness(V second, V third, V count, V rounding, V root) {
  const V m2 = second / count, ratio = third / count / (m2 * root);
  const V moving = m2 > rounding ? ratio : all<V>(0.0);
  return count >= fewest_peaks ? moving : all<V>(0.0);
}

// Inputs of the features that follow from the sums of powers. All alternatives are computed, then
// one is chosen; so a quotient by 0 does no harm.
struct Shape {
  const Powers& p;
  const TaxelBlock::Running& running;
  const FeatureOptions& options;
  double n;
};

// The roots are a loop of their own over plain numbers: only then do compilers vectorise them.
template <class V>
WEFT_INLINE void compute_roots_with(const Shape& of, PerTaxel& norm, PerTaxel& skew) {
  const bool of_signal = of.options.skew == SkewOf::signal, rms = of.options.norm == Norm::rms;
  const PerTaxel& second = of_signal ? of.p.second : of.p.peak_second;
  alignas(64) PerTaxel square{}, m2{};
  for (std::size_t k = 0; k < row_of<V>; k += lanes_of<V>) {
    const V count = of_signal ? all<V>(of.n) : load<V>(&of.running.peaks[k]);
    store(&m2[k], load<V>(&second[k]) / count);
    const V sum = load<V>(&of.running.square[k]);
    store(&square[k], rms ? sum / of.n : sum);
  }
  for (std::size_t k = 0; k < row_of<V>; ++k) skew[k] = std::sqrt(m2[k]);
  for (std::size_t k = 0; k < row_of<V>; ++k) norm[k] = std::sqrt(square[k]);
}

template <class V>
WEFT_INLINE void shape_with(const Shape& of, TaxelBlock::Features& out) {
  const bool of_signal = of.options.skew == SkewOf::signal;
  const Powers& p = of.p;
  const double n = of.n;
  PerTaxel &var = at<Block::var>(out), &kurt = at<Block::kurt>(out), &skew = at<Block::skew>(out);
  PerTaxel &range = at<Block::range>(out), &m5 = at<Block::m5>(out), &sh = at<Block::sh>(out);
  PerTaxel& hfrq = at<Block::hfrq>(out);
  compute_roots_with<V>(of, at<Block::norm>(out), skew);
  const V zero = all<V>(0.0), three = all<V>(kurtosis_of_normal);
  for (std::size_t k = 0; k < row_of<V>; k += lanes_of<V>) {
    const V low = load<V>(&of.running.low[k]), high = load<V>(&of.running.high[k]);
    const V second = load<V>(&p.second[k]), m2 = second / n, rounding = rounding_of(low, high);
    const auto moves = m2 > rounding;
    const V variance = m2 * n / (n - 1.0);
    const V kurtosis = n >= fewest_samples ? load<V>(&p.fourth[k]) / n / (m2 * m2) : three;
    store(&range[k], high - low);
    store(&var[k], moves ? variance : zero);
    store(&kurt[k], moves ? kurtosis : three);
    store(&m5[k], moves ? load<V>(&p.fifth[k]) / n : zero);
    const V root = load<V>(&skew[k]);
    store(&skew[k], of_signal ? skewness(second, load<V>(&p.third[k]), all<V>(n), rounding, root)
                              : skewness(load<V>(&p.peak_second[k]), load<V>(&p.peak_third[k]),
                                         load<V>(&of.running.peaks[k]), rounding, root));
    store(&hfrq[k], moves ? load<V>(&hfrq[k]) : zero);  // a spread of rounding has no spectrum
    store(&sh[k], moves ? load<V>(&sh[k]) : zero);
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void shape_sixteen(const Shape& of, TaxelBlock::Features& out) {
  shape_with<Lanes>(of, out);
}
void shape_two(const Shape& of, TaxelBlock::Features& out) {
  shape_with<double>(of, out);
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

// Rounding keeps the order, so the farthest sample is the smallest or the largest one.
PerTaxel largest_deviation(const TaxelBlock::Running& running, const PerTaxel& mean) {
  PerTaxel out{};
  for (std::size_t k = 0; k < taxels; ++k)
    out[k] = std::max(std::abs(running.low[k] - mean[k]), std::abs(running.high[k] - mean[k]));
  return out;
}

// True if the fifth power of a deviation would not be a normal number.
bool is_tiny(const TaxelBlock::Running& running, std::size_t k) {
  const double range = running.high[k] - running.low[k];
  return range < tiny_range && range > least_range;
}

// Blocks that need their own pass over the samples. The mean is among the powers because they
// determine its rounding.
constexpr BlockSet of_spectrum{Block::hfrq, Block::sh};
constexpr BlockSet of_powers{Block::mean, Block::var,  Block::kurt, Block::skew,
                             Block::m5,   Block::hfrq, Block::sh};

// Exponent of the unit of a feature if the unit of its signal is 2^exponent.
constexpr int exponent_of(Block block) {
  switch (block) {
    case Block::kurt:
    case Block::skew:
      return 0;
    case Block::var:
      return 2;
    case Block::m5:
      return 5;
    default:
      return 1;
  }
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
  // Few samples at a time, so that they are still in the nearest cache for the second pass.
  constexpr std::size_t few = 128;
  for (std::size_t i = 0; i < count; i += few)
    append(counts + i * stride, stride, std::min(few, count - i));
}

void TaxelBlock::append(const double* counts, std::size_t stride, std::size_t count) {
  double* const first = rows_.data() + samples_ * width_;
  if (used_ == width_ && stride == width_) {
    std::copy_n(counts, count * width_, first);
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      double* const end = std::copy_n(counts + i * stride, used_, first + i * width_);
      std::fill(end, first + (i + 1) * width_, 0.0);
    }
  }
  if (samples_ == 0) start(first, width_, running_);
  narrow() ? update_two(first, count, running_) : update_sixteen(first, count, running_);
  samples_ += count;
}

void TaxelBlock::add_spectrum(const PerTaxel& mean, const FeatureOptions& options,
                              BlockTools& tools, Features& out) const {
  const Spectrum& spectrum = tools.spectra.of(samples_);
  const double scale =
      options.spectrum == SpectrumScale::amplitude ? 2.0 / static_cast<double>(samples_) : 1.0;
  const PerTaxel largest = largest_deviation(running_, mean);
  PerTaxel &hfrq = at<Block::hfrq>(out), &sh = at<Block::sh>(out);
  if (narrow()) {
    const double* const bins =
        spectrum.magnitudes<double>(rows_.data(), mean.data(), largest.data(), tools.transform);
    summarise_two(bins, samples_ / 2, scale, hfrq, sh);
  } else {
    const double* const bins =
        spectrum.magnitudes<Lanes>(rows_.data(), mean.data(), largest.data(), tools.transform);
    summarise_sixteen(bins, samples_ / 2, scale, hfrq, sh);
  }
}

// One sample is its own mean: the result of shape_with(), without its quotients.
void TaxelBlock::shape_of_one(Features& out) const {
  at<Block::mean>(out) = running_.last;
  at<Block::kurt>(out).fill(kurtosis_of_normal);
  PerTaxel& norm = at<Block::norm>(out);
  for (std::size_t k = 0; k < taxels; ++k) norm[k] = std::sqrt(running_.square[k]);
}

TaxelBlock::PerTaxel TaxelBlock::modes(const FeatureOptions& options, BlockTools& tools) const {
  return tools.modes.find(rows_.data(), width_, samples_, running_.low, running_.high,
                          options.mode_bin_counts);
}

// Features of signals scaled to about 1, then scaled back. The mode has its own grid.
TaxelBlock::Features TaxelBlock::features_of_tiny(const FeatureOptions& options, BlockTools& tools,
                                                  BlockSet wanted) const {
  std::array<int, taxels> exponent{};
  for (std::size_t k = 0; k < width_; ++k)
    if (is_tiny(running_, k)) exponent[k] = std::ilogb(largest_value(running_, k));
  simd::AlignedDoubles scaled(samples_ * width_);
  for (std::size_t i = 0; i < scaled.size(); ++i)
    scaled[i] = std::ldexp(rows_[i], -exponent[i % width_]);
  TaxelBlock block(used_);
  block.add(scaled.data(), width_, samples_);
  Features out = block.features(options, tools, wanted);
  for (std::size_t f = 0; f < out.size(); ++f)
    for (std::size_t k = 0; k < width_; ++k)
      out[f][k] = std::ldexp(out[f][k], exponent_of(taxel_blocks[f]) * exponent[k]);
  if (wanted.has(Block::mode)) at<Block::mode>(out) = modes(options, tools);
  return out;
}

TaxelBlock::Features TaxelBlock::features(const FeatureOptions& options, BlockTools& tools,
                                          BlockSet wanted) const {
  for (std::size_t k = 0; k < used_; ++k)
    if (is_tiny(running_, k)) return features_of_tiny(options, tools, wanted);
  Features out{};
  at<Block::max>(out) = running_.high;
  at<Block::min>(out) = running_.low;
  if (wanted.has(Block::mode)) at<Block::mode>(out) = modes(options, tools);
  if (samples_ == 1) {
    shape_of_one(out);
    return out;
  }
  Powers p;
  if (wanted.meets(of_powers)) p = powers_of(rows_.data(), width_, samples_, running_);
  at<Block::mean>(out) = p.mean;
  if (wanted.meets(of_spectrum)) add_spectrum(p.mean, options, tools, out);
  const Shape shape{p, running_, options, static_cast<double>(samples_)};
  narrow() ? shape_two(shape, out) : shape_sixteen(shape, out);
  return out;
}

}  // namespace weft::classifier
