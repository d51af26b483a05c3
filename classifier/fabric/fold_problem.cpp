#include "classifier/fabric/fold_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "classifier/learn/distance.hpp"

namespace weft::classifier {
namespace {

void take(std::span<const int> sign, const std::vector<std::size_t>& rows, std::vector<int>& out) {
  out.clear();
  for (const std::size_t r : rows) out.push_back(sign[r]);
}

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

void FoldProblem::reset(const Matrix& rows, std::span<const int> sign, const Reducer& reducer,
                        const Fold& fold, const TrainOptions& options) {
  options_ = &options;
  sizes_ = reducer.sizes();
  train_.clear();
  for (const bool positive : {false, true})
    for (const std::size_t r : fold.train)
      if ((sign[r] > 0) == positive) train_.push_back(r);
  take(sign, train_, train_sign_);
  take(sign, fold.validate, sign_);
  solver_.set_rows(train_sign_, options.search != Search::libsvm);
  holds_kernel_ = false;
  reducer.project(rows, train_, fold.validate, projected_);
  measure();
  scores_.assign(slots_ * options.grid.gamma.size() * options.grid.c.size(), {});
  fits_ = 0;
}

void FoldProblem::measure() {
  slot_of_.resize(sizes_.size());
  bounds_.clear();
  slots_ = 0;
  std::size_t done = 0;
  for (;;) {
    std::size_t next = projected_.cols() + 1;  // smallest size that is still to come
    for (const std::size_t size : sizes_)
      if (size > done) next = std::min(next, size);
    if (next > projected_.cols()) return;
    if (slots_ == distances_.size()) distances_.emplace_back();
    Matrix& squared = distances_[slots_];
    if (slots_ == 0)
      squared.assign(projected_.rows(), train_.size());
    else
      squared = distances_[slots_ - 1];
    add_squared_distances(projected_, projected_, done, next, squared);
    bounds_.emplace_back(squared, train_sign_, sign_);
    for (std::size_t m = 0; m < sizes_.size(); ++m)
      if (sizes_[m] == next) slot_of_[m] = slots_;
    ++slots_;
    done = next;
  }
}

Status FoldProblem::use_kernel(std::size_t slot, std::size_t gamma) {
  if (holds_kernel_ && slot == held_slot_ && gamma == held_gamma_) return {};
  holds_kernel_ = false;
  rbf(distances_[slot], options_->grid.gamma[gamma], kernel_);
  if (auto ok = solver_.set_kernel(kernel_); !ok) return ok;
  held_slot_ = slot;
  held_gamma_ = gamma;
  holds_kernel_ = true;
  return {};
}

GridScore FoldProblem::validate() const {
  GridScore out;
  const auto coefficient = solver_.coefficient();
  for (std::size_t v = 0; v < sign_.size(); ++v) {
    const auto k = kernel_.row(coefficient.size() + v);
    double f = solver_.bias();
    for (std::size_t i = 0; i < k.size(); ++i) f += coefficient[i] * k[i];
    if ((f > 0.0) != (sign_[v] > 0)) ++out.errors;
    out.loss += std::max(0.0, 1.0 - sign_[v] * f);
  }
  return out;
}

Result<GridScore> FoldProblem::score(const GridPoint& at) {
  const std::size_t slot = slot_of_[at.member];
  Remembered& wanted = scores_[number_of(at.gamma, at.c, slot)];
  if (wanted.known) return wanted.score;
  if (auto ok = use_kernel(slot, at.gamma); !ok) return pass(ok.error());
  const std::vector<double>& cs = options_->grid.c;
  if (auto ok = solver_.solve(cs[at.c], options_->tolerance); !ok) return pass(ok.error());
  ++fits_;
  if (!solver_.converged()) note_unconverged(*options_);
  wanted = {validate(), true};
  if (!solver_.holds_for_larger_c()) return wanted.score;
  for (std::size_t other = 0; other < cs.size(); ++other)
    if (cs[other] > cs[at.c]) scores_[number_of(at.gamma, other, slot)] = wanted;
  return wanted.score;
}

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
