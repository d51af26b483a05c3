#include "classifier/fabric/loss_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft::classifier {
namespace {

constexpr double rounding = 1e-9;
constexpr double float_rounding = 1e-7;  // of the solvers' kernel

double smallest(std::span<const double> values, double least) {
  for (const double v : values) least = std::min(least, v);
  return least;
}

double reach_of(std::span<const double> positive, std::span<const double> negative,
                std::span<const int> train) {
  double sum = 0.0;
  for (std::size_t i = 0; i < train.size(); ++i) {
    const double nearer = negative[i] - positive[i];
    sum += std::max(0.0, train[i] > 0 ? nearer : -nearer);
  }
  return sum;
}

}  // namespace

LossBound::LossBound(const Matrix& squared, std::span<const int> train,
                     std::span<const int> held_out)
    : rows_(static_cast<double>(train.size())),
      nearest_train_(std::numeric_limits<double>::infinity()),
      nearest_across_(nearest_train_) {
  for (std::size_t i = 0; i < train.size(); ++i)
    nearest_train_ = smallest(squared.row(i).first(i), nearest_train_);
  for (std::size_t v = 0; v < held_out.size(); ++v)
    nearest_across_ = smallest(squared.row(train.size() + v), nearest_across_);
  std::size_t n = 0;
  for (std::size_t p = 0; p < held_out.size(); ++p) {
    if (held_out[p] <= 0) continue;
    while (n < held_out.size() && held_out[n] > 0) ++n;
    if (n == held_out.size()) return;
    reach_.push_back(reach_of(squared.row(train.size() + p), squared.row(train.size() + n), train));
    ++n;
  }
}

// The most that f(p) - f(n) can be for any pair, where the kernel is nearly the identity.
double LossBound::farthest_apart(double c, double gamma) const {
  constexpr double useful_exponent = 2.0;  // a larger kernel value bounds nothing
  if (!(gamma * nearest_across_ > useful_exponent)) return std::numeric_limits<double>::infinity();
  const double largest = std::exp(-gamma * nearest_across_);
  const double off_diagonal = rows_ * (std::exp(-gamma * nearest_train_) + float_rounding);
  const double dual = off_diagonal < 1.0 ? 2.0 * rows_ / (1.0 - off_diagonal) : rows_ * c;
  return largest * std::min(rows_ * c, dual);
}

double LossBound::least_loss(double c, double gamma) const {
  const double apart = farthest_apart(c, gamma);
  double sum = 0.0;
  for (const double reach : reach_)
    sum += std::max(0.0, 2.0 - std::min(c * gamma * reach, apart) * (1.0 + rounding) - rounding);
  return sum;
}

}  // namespace weft::classifier
