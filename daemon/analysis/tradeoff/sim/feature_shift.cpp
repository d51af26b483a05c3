// How features move and re-rank between levels.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "daemon/analysis/tradeoff/sim/downstream.hpp"

namespace weft::daemon {

namespace {

/// Sums of one column over the rows of each label.
struct LabelSums {
  struct Sum {
    double count = 0, mean = 0, squares = 0;  // squares: about the mean (Welford)
  };
  std::map<std::string, Sum> of;

  LabelSums(const classifier::FeatureMatrix& features, std::size_t column) {
    for (std::size_t row = 0; row < features.size(); ++row) {
      Sum& sum = of[features.labels[row]];
      const double x = features.values(row, column), before = x - sum.mean;
      sum.mean += before / ++sum.count;
      sum.squares += before * (x - sum.mean);
    }
  }
  [[nodiscard]] double rows() const {
    double n = 0;
    for (const auto& [label, sum] : of) n += sum.count;
    return n;
  }
  /// Pooled variance within labels.
  [[nodiscard]] double within() const {
    double squares = 0;
    for (const auto& [label, sum] : of) squares += sum.squares;
    return squares / std::max(1.0, rows() - static_cast<double>(of.size()));
  }
  [[nodiscard]] double between() const {
    double mean = 0, squares = 0;
    for (const auto& [label, sum] : of) mean += sum.count * sum.mean;
    mean /= rows();
    for (const auto& [label, sum] : of)
      squares += sum.count * (sum.mean - mean) * (sum.mean - mean);
    return squares / std::max(1.0, static_cast<double>(of.size()) - 1);
  }
};

std::vector<double> ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < order.size();) {
    std::size_t end = i;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    const double mean = 0.5 * static_cast<double>(i + end - 1);
    for (; i < end; ++i) out[order[i]] = mean;
  }
  return out;
}

}  // namespace

std::vector<double> f_statistics(const classifier::FeatureMatrix& features) {
  std::vector<double> out;
  for (std::size_t column = 0; column < features.values.cols(); ++column) {
    const LabelSums sums(features, column);
    const double within = sums.within(), between = sums.between();
    out.push_back(within > 0    ? between / within
                  : between > 0 ? std::numeric_limits<double>::infinity()
                                : 0);
  }
  return out;
}

double spearman(std::span<const double> a, std::span<const double> b) {
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double middle = 0.5 * (static_cast<double>(x.size()) - 1);
  double xy = 0, xx = 0, yy = 0;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    xy += (x[i] - middle) * (y[i] - middle);
    xx += (x[i] - middle) * (x[i] - middle);
    yy += (y[i] - middle) * (y[i] - middle);
  }
  return xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

std::vector<double> feature_shifts(const classifier::FeatureMatrix& features,
                                   const classifier::FeatureMatrix& yardstick) {
  std::vector<double> out;
  for (std::size_t column = 0; column < yardstick.values.cols(); ++column) {
    const LabelSums here(features, column), there(yardstick, column);
    const double deviation = std::sqrt(there.within());
    double sum = 0;
    for (const auto& [label, one] : there.of) sum += std::abs(here.of.at(label).mean - one.mean);
    const double mean = sum / static_cast<double>(there.of.size());
    out.push_back(deviation > 0 ? mean / deviation
                  : mean > 0    ? std::numeric_limits<double>::infinity()
                                : 0);
  }
  return out;
}

std::size_t most_shifted(std::span<const std::vector<double>> by_seed) {
  std::vector<double> sum = by_seed.front();
  for (const std::vector<double>& shifts : by_seed.subspan(1))
    for (std::size_t f = 0; f < sum.size(); ++f) sum[f] += shifts[f];
  return static_cast<std::size_t>(std::ranges::max_element(sum) - sum.begin());
}

}  // namespace weft::daemon
