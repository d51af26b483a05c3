#include "classifier/base/interval.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "classifier/base/student_t.hpp"

namespace weft::classifier {
namespace {

struct CriticalValues {
  const char* of_one;  ///< "split"
  const char* method;
  bool whole_groups = false;
};

// Wilson's interval of the mean answers of one share. With whole groups the number of groups limits
// the number of answers.
Interval compute_floor(double share, double answers, std::size_t splits,
                       const CriticalValues& words) {
  const auto count = static_cast<double>(splits);
  Interval out =
      wilson_of_share(share, words.whole_groups ? std::min(count, answers) : answers / count);
  out.method =
      std::string("Wilson score of ") + (words.whole_groups ? std::to_string(splits) + " groups"
                                                            : std::string("one ") + words.of_one);
  return out;
}

// Share plus or minus t times the deviation times `widening`, cut to [0, 1]. With whole groups it
// is at least as wide as the floor. Without a deviation the floor is the interval.
Interval t_interval(std::span<const SplitShare> shares, double widening,
                    const CriticalValues& words) {
  constexpr double rounding = 1e-12;  // rounding error of equal shares
  const auto count = static_cast<double>(shares.size());
  double part = 0.0, whole = 0.0;
  for (const SplitShare& one : shares) {
    part += one.part;
    whole += one.whole;
  }
  if (!(whole > 0.0)) return {0.0, 1.0, "no answers"};
  const double share = part / whole;
  std::vector<double> residual;
  for (const SplitShare& one : shares)
    residual.push_back((one.part - share * one.whole) * count / whole);
  const double deviation = compute_deviation(residual);
  Interval floor = compute_floor(share, whole, shares.size(), words);
  if (!(deviation > rounding)) {
    floor.method +=
        std::string(", all ") + (words.whole_groups ? "group" : words.of_one) + "s agree";
    return floor;
  }
  const double half = critical_t(0.05, count - 1.0) * deviation * widening;
  Interval out{std::max(0.0, share - half), std::min(1.0, share + half), words.method};
  if (words.whole_groups && (floor.low < out.low || floor.high > out.high)) {
    out.low = std::min(out.low, floor.low);
    out.high = std::max(out.high, floor.high);
    out.method += std::string(widened_to) + floor.method;
  }
  return out;
}

// Gives all figures the same weight.
std::vector<SplitShare> equal_shares(std::span<const double> figures, double whole) {
  std::vector<SplitShare> out;
  for (const double figure : figures) out.push_back({figure * whole, whole});
  return out;
}

}  // namespace

SplitSizes mean_sizes(std::span<const SplitSizes> splits) {
  SplitSizes out;
  for (const SplitSizes& one : splits) {
    out.train += one.train;
    out.test += one.test;
  }
  out.whole_groups = std::ranges::all_of(splits, &SplitSizes::whole_groups);
  out.train /= static_cast<double>(splits.size());
  out.test /= static_cast<double>(splits.size());
  return out;
}

Interval wilson_interval(std::size_t correct, std::size_t total) {
  const auto n = static_cast<double>(total);
  return wilson_of_share(total == 0 ? 0 : static_cast<double>(correct) / n, n);
}

Interval wilson_of_share(double share, double total) {
  Interval out{0.0, 1.0, "Wilson score, one split"};
  if (!(total > 0)) return out;
  const double p = share;
  const double z2 = z95 * z95 / total;
  const double centre = (p + z2 / 2.0) / (1.0 + z2);
  const double half = z95 * std::sqrt(p * (1.0 - p) / total + z2 / (4.0 * total)) / (1.0 + z2);
  // At 0 and 1 the formula is exact up to rounding; set the ends exactly.
  out.low = p <= 0.0 ? 0.0 : std::max(0.0, centre - half);
  out.high = p >= 1.0 ? 1.0 : std::min(1.0, centre + half);
  return out;
}

Interval split_interval(std::span<const SplitShare> shares, const SplitSizes& sizes) {
  if (shares.size() == 1 && shares.front().whole > 0.0)
    return wilson_of_share(shares.front().part / shares.front().whole, shares.front().whole);
  const double inflation = 1.0 / static_cast<double>(shares.size()) + sizes.test / sizes.train;
  return t_interval(
      shares, std::sqrt(inflation),
      {"split",
       "Student t with the Nadeau-Bengio variance, mean over random splits of the same data",
       sizes.whole_groups});
}

Interval split_interval(std::span<const double> accuracy, const SplitSizes& sizes) {
  return split_interval(equal_shares(accuracy, sizes.test), sizes);
}

Interval repetition_interval(std::span<const double> accuracy, std::size_t test) {
  return t_interval(equal_shares(accuracy, static_cast<double>(test)),
                    1.0 / std::sqrt(static_cast<double>(accuracy.size())),
                    {"repetition", "Student t, mean over repetitions with data of their own"});
}

double compute_mean(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

double compute_deviation(std::span<const double> values) {
  if (values.size() < 2) return 0.0;
  const double mean = compute_mean(values);
  double square = 0.0;
  for (const double v : values) square += (v - mean) * (v - mean);
  return std::sqrt(square / static_cast<double>(values.size() - 1));
}

}  // namespace weft::classifier
