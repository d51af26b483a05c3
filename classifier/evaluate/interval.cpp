#include "classifier/evaluate/interval.hpp"

#include <algorithm>
#include <cmath>

#include "classifier/selection/student_t.hpp"

namespace weft::classifier {
namespace {

// Mean and t times the deviation times `widening`, cut to [0, 1]; of accuracies without a
// deviation, Wilson's interval of one of them.
Interval t_interval(std::span<const double> accuracy, std::size_t test, double widening,
                    const char* what, const char* method) {
  constexpr double rounding = 1e-12;  // of shares that are computed alike
  const double mean = mean_of(accuracy);
  const double deviation = deviation_of(accuracy);
  if (!(deviation > rounding)) {
    Interval one = wilson_interval(
        static_cast<std::size_t>(std::llround(mean * static_cast<double>(test))), test);
    one.method = std::string("Wilson score of one ") + what + ", all " + what + "s agree";
    return one;
  }
  const double half =
      critical_t(0.05, static_cast<double>(accuracy.size()) - 1.0) * deviation * widening;
  return {std::max(0.0, mean - half), std::min(1.0, mean + half), method};
}

}  // namespace

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
  // the ends are exact where the formula is so up to rounding
  out.low = p <= 0.0 ? 0.0 : std::max(0.0, centre - half);
  out.high = p >= 1.0 ? 1.0 : std::min(1.0, centre + half);
  return out;
}

Interval split_interval(std::span<const double> accuracy, std::size_t train, std::size_t test) {
  const double inflation = 1.0 / static_cast<double>(accuracy.size()) +
                           static_cast<double>(test) / static_cast<double>(train);
  return t_interval(
      accuracy, test, std::sqrt(inflation), "split",
      "Student t with the Nadeau-Bengio variance, mean over random splits of the same data");
}

Interval repetition_interval(std::span<const double> accuracy, std::size_t test) {
  return t_interval(accuracy, test, 1.0 / std::sqrt(static_cast<double>(accuracy.size())),
                    "repetition", "Student t, mean over repetitions with data of their own");
}

double mean_of(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

double deviation_of(std::span<const double> values) {
  if (values.size() < 2) return 0.0;
  const double mean = mean_of(values);
  double square = 0.0;
  for (const double v : values) square += (v - mean) * (v - mean);
  return std::sqrt(square / static_cast<double>(values.size() - 1));
}

}  // namespace weft::classifier
