#include "classifier/baseline/paired_choice.hpp"

#include <cmath>
#include <numbers>
#include <numeric>

namespace weft::classifier {
namespace {

// One standard deviation of a normal distribution, one-sided.
const double one_deviation = 0.5 * std::erfc(1.0 / std::numbers::sqrt2);

bool clearly_worse(const TimesWrong& candidate, const TimesWrong& best) {
  std::size_t more = 0, fewer = 0;
  for (std::size_t i = 0; i < best.size(); ++i) {
    more += candidate[i] > best[i] ? 1 : 0;
    fewer += best[i] > candidate[i] ? 1 : 0;
  }
  return sign_test(more, fewer) < one_deviation;
}

}  // namespace

std::size_t choice_rounds(std::size_t trials) {
  constexpr std::size_t few = 100, rounds = 5;
  return trials < few ? rounds : 1;
}

std::size_t times_wrong(const TimesWrong& wrong) {
  return std::accumulate(wrong.begin(), wrong.end(), std::size_t{0});
}

double sign_test(std::size_t more, std::size_t fewer) {
  if (fewer >= more) return 0.5;
  const auto n = static_cast<double>(more + fewer);
  // From the likeliest outcome down: each binomial coefficient from the one before.
  const auto k = static_cast<double>(fewer);
  const double last = std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1);
  double term = 1.0, sum = 1.0;
  for (double i = k; i > 0.0; --i) sum += term *= i / (n - i + 1);
  return std::exp(last - n * std::numbers::ln2) * sum;
}

std::size_t first_not_clearly_worse(const std::vector<TimesWrong>& wrong) {
  const std::size_t trials = wrong.front().size();
  std::size_t best = 0;
  for (std::size_t c = 1; c < wrong.size(); ++c)
    if (wrong[c].size() == trials && times_wrong(wrong[c]) < times_wrong(wrong[best])) best = c;
  for (std::size_t c = 0; c < best; ++c)
    if (wrong[c].size() == trials && !clearly_worse(wrong[c], wrong[best])) return c;
  return best;
}

}  // namespace weft::classifier
