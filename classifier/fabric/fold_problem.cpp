#include "classifier/fabric/fold_problem.hpp"

#include <algorithm>

#include "classifier/learn/distance.hpp"

namespace weft::classifier {
namespace {

void take(std::span<const int> sign, const std::vector<std::size_t>& rows, std::vector<int>& out) {
  out.clear();
  for (const std::size_t r : rows) out.push_back(sign[r]);
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

}  // namespace weft::classifier
