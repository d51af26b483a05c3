#include "classifier/features/signal.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

// A relative variance that is only rounding: 0.1 repeated has 2e-34 (reference: ml.md 6).
constexpr double constant_tolerance = 1e-24;

// Longest run of equal values in a sorted range, the first of several.
double most_frequent(std::span<const double> sorted) {
  double best = sorted.front();
  std::size_t best_count = 0;
  for (std::size_t i = 0; i < sorted.size();) {
    std::size_t j = i;
    while (j < sorted.size() && sorted[j] == sorted[i]) ++j;
    if (j - i > best_count) {
      best_count = j - i;
      best = sorted[i];
    }
    i = j;
  }
  return best;
}

// Counting instead of sorting: sensor counts span far fewer values than there are samples.
constexpr double widest_count = 4096.0;

double most_frequent_counted(std::span<const double> whole, double lowest, std::size_t span) {
  std::vector<std::size_t> count(span, 0);
  for (const double v : whole) ++count[static_cast<std::size_t>(v - lowest)];
  return lowest + static_cast<double>(std::max_element(count.begin(), count.end()) - count.begin());
}

}  // namespace

Moments moments_of(std::span<const double> signal) {
  Moments out;
  if (signal.empty()) return out;
  const auto n = static_cast<double>(signal.size());
  double sum = 0.0;  // exact for counts: below 2^53
  for (const double v : signal) sum += v;
  out.mean = sum / n;
  double s2 = 0.0, s3 = 0.0, s4 = 0.0, s5 = 0.0;
  for (const double v : signal) {
    const double c = v - out.mean;
    const double c2 = c * c;
    s2 += c2;
    s3 += c2 * c;
    s4 += c2 * c2;
    s5 += c2 * c2 * c;
  }
  out.constant = !(s2 / n > constant_tolerance * std::max(1.0, out.mean * out.mean));
  if (out.constant) return out;
  out.m2 = s2 / n;
  out.m3 = s3 / n;
  out.m4 = s4 / n;
  out.m5 = s5 / n;
  return out;
}

double skewness_of(std::span<const double> signal) {
  if (signal.size() < 3) return 0.0;
  const Moments m = moments_of(signal);
  return m.constant ? 0.0 : m.m3 / (m.m2 * std::sqrt(m.m2));
}

void local_maxima(std::span<const double> signal, std::vector<double>& out) {
  out.clear();
  bool rising = false;
  for (std::size_t i = 1; i < signal.size(); ++i) {
    if (signal[i] > signal[i - 1]) {
      rising = true;
    } else if (signal[i] < signal[i - 1]) {
      if (rising) out.push_back(signal[i - 1]);
      rising = false;
    }
  }
}

double mode_of(std::span<const double> signal, double bin) {
  if (signal.empty()) return 0.0;
  std::vector<double> whole(signal.size());
  std::transform(signal.begin(), signal.end(), whole.begin(),
                 [bin](double v) { return std::nearbyint(v / bin); });
  const auto [lowest, highest] = std::minmax_element(whole.begin(), whole.end());
  const double span = *highest - *lowest + 1.0;
  if (span <= widest_count) {
    return bin * most_frequent_counted(whole, *lowest, static_cast<std::size_t>(span));
  }
  std::sort(whole.begin(), whole.end());
  return bin * most_frequent(whole);
}

}  // namespace weft::classifier
