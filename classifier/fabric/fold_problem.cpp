#include "classifier/fabric/fold_problem.hpp"

#include <algorithm>
#include <limits>
#include <set>

#include "classifier/learn/distance.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t nothing = std::numeric_limits<std::size_t>::max();

std::vector<int> take(std::span<const int> sign, const std::vector<std::size_t>& rows) {
  std::vector<int> out;
  out.reserve(rows.size());
  for (const std::size_t r : rows) out.push_back(sign[r]);
  return out;
}

}  // namespace

FoldProblem::FoldProblem(const Matrix& rows, std::span<const int> sign, const Reducer& reducer,
                         const Fold& fold, const TrainOptions& options)
    : options_(&options),
      sizes_(reducer.sizes()),
      sign_(take(sign, fold.validate)),
      solver_(take(sign, fold.train), options.search != Search::libsvm),
      held_slot_(nothing),
      held_gamma_(nothing) {
  measure(reducer.project(rows, fold.train, fold.validate), take(sign, fold.train));
  scores_.resize(distances_.size() * options.grid.gamma.size() * options.grid.c.size());
}

void FoldProblem::measure(const Matrix& projected, std::span<const int> train_sign) {
  Distances sum{0, Matrix(projected.rows(), projected.rows() - sign_.size())};
  slot_of_.resize(sizes_.size());
  for (const std::size_t size : std::set<std::size_t>(sizes_.begin(), sizes_.end())) {
    add_squared_distances(projected, projected, sum.size, size, sum.squared);
    sum.size = size;
    for (std::size_t m = 0; m < sizes_.size(); ++m)
      if (sizes_[m] == size) slot_of_[m] = distances_.size();
    distances_.push_back(sum);
    bounds_.emplace_back(sum.squared, train_sign, sign_);
  }
}

Status FoldProblem::use_kernel(std::size_t slot, std::size_t gamma) {
  if (slot == held_slot_ && gamma == held_gamma_) return {};
  held_slot_ = nothing;
  rbf(distances_[slot].squared, options_->grid.gamma[gamma], kernel_);
  if (auto ok = solver_.set_kernel(kernel_); !ok) return ok;
  held_slot_ = slot;
  held_gamma_ = gamma;
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

FoldProblem::Remembered& FoldProblem::remembered(std::size_t slot, std::size_t gamma,
                                                 std::size_t c) {
  return scores_[(slot * options_->grid.gamma.size() + gamma) * options_->grid.c.size() + c];
}

Result<GridScore> FoldProblem::score(std::size_t member, std::size_t gamma, std::size_t c) {
  const std::size_t slot = slot_of_[member];
  Remembered& wanted = remembered(slot, gamma, c);
  if (wanted.known) return wanted.score;
  if (auto ok = use_kernel(slot, gamma); !ok) return pass(ok.error());
  const std::vector<double>& cs = options_->grid.c;
  if (auto ok = solver_.solve(cs[c], options_->tolerance); !ok) return pass(ok.error());
  ++fits_;
  wanted = {validate(), true};
  if (!solver_.holds_for_larger_c()) return wanted.score;
  for (std::size_t other = 0; other < cs.size(); ++other)
    if (cs[other] > cs[c]) remembered(slot, gamma, other) = wanted;
  return wanted.score;
}

}  // namespace weft::classifier
