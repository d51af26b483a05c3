#include "classifier/features/powers.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

constexpr double epsilon = 0x1p-52;
// A mean is recomputed in two passes if its sum may be off by more than the first share of the
// deviation. The new mean replaces it if they differ by more than the second.
constexpr double sum_tolerance = 1e-6, mean_tolerance = 1e-10;

// True if the naive sum of `count` values may be off by more than its tolerance.
bool needs_refining(double count, double largest, double second) {
  const double error = count * epsilon * largest;
  return error * error * count > sum_tolerance * sum_tolerance * second;
}

// A mean as a double and its remainder, so that deviations keep all their digits.
struct Mean {
  double value, rest = 0.0;

  [[nodiscard]] double deviation(double v) const { return (v - value) - rest; }
  void move(double by) {
    const double next = value + (rest + by);
    rest = (value - next) + (rest + by);
    value = next;
  }
};

// Samples of one signal among those side by side.
struct Column {
  const double* first;
  std::size_t width, samples;

  // Calls on_sample() with each value and on_peak() with each strict local maximum.
  template <class OnSample, class OnPeak>
  void visit(OnSample on_sample, OnPeak on_peak) const {
    double last = *first, rising = 0.0;
    for (std::size_t i = 0; i < samples; ++i) {
      const double v = first[i * width];
      on_sample(v);
      if (is_peak(v, last, rising) > 0.0) on_peak(last);
      last = v;
    }
  }
};

// Two-pass means of signal `k`, and the sums of powers about them. A mean within the tolerance
// stays as it is, bit for bit.
void refine(const Column& column, double peaks, std::size_t k, Powers& out) {
  const auto n = static_cast<double>(column.samples);
  Mean mean{out.mean[k]}, peak_mean{out.peak_mean[k]};
  bool moved = false, peaks_moved = false;
  for (int round = 0; round < 2; ++round) {
    double sum = 0.0, peak_sum = 0.0;
    column.visit([&](double v) { sum += mean.deviation(v); },
                 [&](double v) { peak_sum += peak_mean.deviation(v); });
    const double by = sum / n, peaks_by = peak_sum / std::max(peaks, 1.0);
    moved = moved || std::abs(by) > mean_tolerance * std::sqrt(out.second[k] / n);
    peaks_moved =
        peaks_moved || std::abs(peaks_by) > mean_tolerance * std::sqrt(out.peak_second[k] / peaks);
    if (moved) mean.move(by);
    if (peaks_moved) peak_mean.move(peaks_by);
  }
  if (!moved && !peaks_moved) return;
  out.mean[k] = mean.value, out.peak_mean[k] = peak_mean.value;
  double s2 = 0.0, s3 = 0.0, s4 = 0.0, s5 = 0.0, p2 = 0.0, p3 = 0.0;
  column.visit(
      [&](double v) {
        const double c = mean.deviation(v), c2 = c * c;
        s2 += c2, s3 += c2 * c, s4 += c2 * c2, s5 += c2 * c2 * c;
      },
      [&](double v) {
        const double c = peak_mean.deviation(v);
        p2 += c * c, p3 += c * c * c;
      });
  out.second[k] = s2, out.third[k] = s3, out.fourth[k] = s4, out.fifth[k] = s5;
  out.peak_second[k] = p2, out.peak_third[k] = p3;
}

}  // namespace

double largest_value(const TaxelBlock::Running& running, std::size_t k) {
  return std::max(std::abs(running.low[k]), std::abs(running.high[k]));
}

void refine_where_needed(const double* rows, std::size_t width, std::size_t samples,
                         const TaxelBlock::Running& running, Powers& out) {
  const auto n = static_cast<double>(samples);
  for (std::size_t k = 0; k < width; ++k) {
    if (running.high[k] == running.low[k]) continue;
    const double largest = largest_value(running, k), peaks = running.peaks[k];
    const bool of_peaks = peaks >= fewest_peaks && out.peak_second[k] > 0.0 &&
                          needs_refining(peaks, largest, out.peak_second[k]);
    if (of_peaks || needs_refining(n, largest, out.second[k]))
      refine({rows + k, width, samples}, peaks, k, out);
  }
}

}  // namespace weft::classifier
