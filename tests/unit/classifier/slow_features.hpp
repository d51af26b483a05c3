#pragma once
// Table I of Khan et al. 2016 directly from its definitions, one signal after the other, in long
// double for long sums: the reference for the fast extraction.

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace weft::classifier::testing {

/// |DFT| by its definition, bins 0 .. n / 2.
inline std::vector<double> slow_magnitudes(const std::vector<double>& signal) {
  const std::size_t n = signal.size();
  std::vector<double> out;
  for (std::size_t k = 0; k <= n / 2; ++k) {
    long double re = 0, im = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const long double angle = 2.0L * std::numbers::pi_v<long double> *
                                static_cast<long double>(j * k % n) / static_cast<long double>(n);
      re += signal[j] * std::cos(angle);
      im -= signal[j] * std::sin(angle);
    }
    out.push_back(static_cast<double>(std::sqrt(re * re + im * im)));
  }
  return out;
}

inline double slow_mean(const std::vector<double>& v) {
  long double sum = 0;
  for (const double x : v) sum += x;
  return v.empty() ? 0.0 : static_cast<double>(sum / static_cast<long double>(v.size()));
}

/// Biased central moment.
inline double slow_moment(const std::vector<double>& v, int power) {
  const long double mean = slow_mean(v);
  long double sum = 0;
  for (const double x : v) sum += std::pow(x - mean, power);
  return static_cast<double>(sum / static_cast<long double>(v.size()));
}

inline double slow_skewness(const std::vector<double>& v) {
  if (v.size() < 3 || slow_moment(v, 2) == 0.0) return 0.0;
  return slow_moment(v, 3) / std::pow(slow_moment(v, 2), 1.5);
}

/// Strict local maxima: a value above the previous different one and above the next different one.
inline std::vector<double> slow_peaks(const std::vector<double>& v) {
  std::vector<double> distinct, out;
  for (const double x : v)
    if (distinct.empty() || x != distinct.back()) distinct.push_back(x);
  for (std::size_t i = 1; i + 1 < distinct.size(); ++i)
    if (distinct[i] > distinct[i - 1] && distinct[i] > distinct[i + 1]) out.push_back(distinct[i]);
  return out;
}

inline double slow_mode(const std::vector<double>& v, double bin) {
  std::map<double, std::size_t> count;
  for (const double x : v) ++count[std::nearbyint(x / bin)];
  const auto most = std::max_element(
      count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return bin * most->first;
}

/// The twelve features of one varying signal of four samples or more, in Table I's order.
inline std::vector<double> slow_features(const std::vector<double>& v) {
  const auto n = static_cast<double>(v.size());
  const auto [low, high] = std::minmax_element(v.begin(), v.end());
  std::vector<double> centred = v;
  for (double& x : centred) x -= slow_mean(v);
  long double square = 0, upper = 0;
  for (const double x : v) square += static_cast<long double>(x) * x;
  const std::vector<double> bins = slow_magnitudes(centred);
  const std::size_t top = v.size() / 2;
  for (std::size_t k = top / 2 + 1; k <= top; ++k) upper += bins[k];
  return {*high,
          *low,
          slow_mean(v),
          slow_moment(v, 2) * n / (n - 1.0),
          static_cast<double>(std::sqrt(square)),
          slow_moment(v, 4) / (slow_moment(v, 2) * slow_moment(v, 2)),
          slow_skewness(slow_peaks(v)),
          *high - *low,
          slow_mode(v, 1.0),
          slow_moment(v, 5),
          2.0 / n * *std::max_element(bins.begin() + 1, bins.end()),
          2.0 / n * static_cast<double>(upper)};
}

}  // namespace weft::classifier::testing
