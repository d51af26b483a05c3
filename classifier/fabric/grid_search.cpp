#include "classifier/fabric/grid_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include "classifier/learn/svm_solver.hpp"

namespace weft::classifier {
namespace {

Status check_fold(const Fold& fold, std::span<const int> sign, const TrainOptions& options) {
  bool positive = false, negative = false;
  for (const auto* rows : {&fold.train, &fold.validate}) {
    for (const std::size_t r : *rows) {
      if (r >= sign.size()) {
        return fail({.code = Errc::range,
                     .where = "folds",
                     .what = "fold names an unknown row",
                     .expected = "< " + std::to_string(sign.size()),
                     .got = std::to_string(r)});
      }
    }
  }
  for (const std::size_t r : fold.train) (sign[r] > 0 ? positive : negative) = true;
  if (!positive || !negative)
    return fail({.code = Errc::invalid_argument,
                 .where = "folds",
                 .what = "fold trains on one class only"});
  if (options.nested && options.reduction == Reduction::pvalue &&
      fold.train.size() < least_fold_rows) {
    return fail({.code = Errc::invalid_argument,
                 .where = "folds",
                 .what = "fold too small for feature selection",
                 .expected = "at least " + std::to_string(least_fold_rows) + " training rows",
                 .got = std::to_string(fold.train.size()),
                 .hint = "Use fewer validation rows or nested = false"});
  }
  return {};
}

// Order of grid points: fewest errors, then (not with Tie::order) smallest loss to 1e-9, smallest
// C, gamma and first member.
using Key = std::tuple<std::size_t, double, double, double, std::size_t>;

Key key_of(const TrainOptions& options, const GridPoint& at, const GridScore& score) {
  const double loss = options.tie == Tie::order ? 0.0 : std::nearbyint(score.loss * 1e9);
  return {score.errors, loss, options.grid.c[at.c], options.grid.gamma[at.gamma], at.member};
}

// Keeps the best point so far.
class Choice {
 public:
  Choice(const TrainOptions& options, GridResult& result) : options_(options), result_(result) {}

  void offer(const GridPoint& at, const GridScore& score) {
    const Key key = key_of(options_, at, score);
    if (any_ && !(key < best_)) return;
    any_ = true;
    best_ = key;
    result_.member = at.member;
    result_.gamma = at.gamma;
    result_.c = at.c;
    result_.best = score;
  }

  // True if a point with the partial score `part` can still win: more folds only add errors and
  // loss.
  [[nodiscard]] bool open(const GridPoint& at, const GridScore& part) const {
    if (!any_ || part.errors < result_.best.errors) return true;
    if (part.errors > result_.best.errors) return false;
    if (options_.tie == Tie::order) return key_of(options_, at, part) < best_;
    // twice the resolution of the key, plus the rounding of the sum
    return part.loss <= result_.best.loss * (1.0 + 1e-12) + 2e-9;
  }

 private:
  const TrainOptions& options_;
  GridResult& result_;
  Key best_;
  bool any_ = false;
};

using FoldProblems = std::vector<FoldProblem>;

Status add(GridScore& sum, const Result<GridScore>& score) {
  if (!score) return pass(score.error());
  sum.errors += score->errors;
  sum.loss += score->loss;
  return {};
}

Result<GridScore> total(FoldProblems& folds, const GridPoint& at) {
  GridScore sum;
  for (FoldProblem& fold : folds)
    if (auto ok = add(sum, fold.score(at)); !ok) return pass(ok.error());
  return sum;
}

Status search_whole(FoldProblems& folds, std::size_t members, const TrainOptions& options,
                    GridResult& result) {
  Choice choice(options, result);
  for (std::size_t m = 0; m < members; ++m) {
    for (std::size_t g = 0; g < options.grid.gamma.size(); ++g) {
      for (std::size_t c = 0; c < options.grid.c.size(); ++c) {
        const auto score = total(folds, {m, g, c});
        if (!score) return pass(score.error());
        result.scores.push_back(*score);
        choice.offer({m, g, c}, *score);
      }
    }
  }
  return {};
}

// Searches all Cs of one member and gamma together, fold by fold. It drops a point as soon as it
// cannot win. The fold that last dropped a point goes first, as one hard fold drops most points.
class FastSearch {
 public:
  FastSearch(FoldProblems& folds, const TrainOptions& options, GridResult& result)
      : folds_(folds), options_(options), choice_(options, result) {
    for (std::size_t f = 0; f < folds.size(); ++f) order_.push_back(f);
  }

  Status run(std::size_t members) {
    for (const std::size_t gamma : {std::size_t{0}, options_.grid.gamma.size() / 3})
      if (auto ok = probe(gamma); !ok) return ok;
    for (std::size_t m = 0; m < members; ++m) {
      if (seen_before(m)) continue;
      for (const std::size_t g : likely_first(options_.grid.gamma.size()))
        if (auto ok = column(m, g); !ok) return ok;
    }
    return {};
  }

 private:
  // True if an earlier member has the same number of directions in every fold; that one wins the
  // tie.
  bool seen_before(std::size_t member) const {
    for (std::size_t m = 0; m < member; ++m) {
      if (std::all_of(folds_.begin(), folds_.end(), [&](const FoldProblem& fold) {
            return fold.size_of(m) == fold.size_of(member);
          }))
        return true;
    }
    return false;
  }

  // Scores one point that often wins: an early good point lets the search drop others sooner.
  Status probe(std::size_t gamma) {
    constexpr double usual_product =
        0x1p-4;  // product of C and gamma at which the kernel is nearly linear
    const auto& cs = options_.grid.c;
    const auto distance = [&](double c) {
      return std::abs(std::log(c) + std::log(options_.grid.gamma[gamma] / usual_product));
    };
    const auto c = std::min_element(cs.begin(), cs.end(),
                                    [&](double a, double b) { return distance(a) < distance(b); });
    const GridPoint at{0, gamma, static_cast<std::size_t>(c - cs.begin())};
    const auto score = total(folds_, at);
    if (!score) return pass(score.error());
    choice_.offer(at, *score);
    return {};
  }

  // Gammas near the usual winners come first.
  static std::vector<std::size_t> likely_first(std::size_t count) {
    std::vector<std::size_t> out;
    const std::size_t start = count / 3;
    for (std::size_t k = start; k < count; k = k <= start ? (k == 0 ? start + 1 : k - 1) : k + 1)
      out.push_back(k);
    return out;
  }

  Status column(std::size_t member, std::size_t gamma) {
    alive_.clear();
    part_.assign(options_.grid.c.size(), {});
    for (std::size_t c = 0; c < part_.size(); ++c)
      if (open_after(0, {member, gamma, c})) alive_.push_back(c);
    for (std::size_t place = 0; place < order_.size() && !alive_.empty(); ++place)
      if (auto ok = fold(place, member, gamma); !ok) return ok;
    for (const std::size_t c : alive_) {
      const auto score = total(folds_, {member, gamma, c});
      if (!score) return pass(score.error());
      choice_.offer({member, gamma, c}, *score);
    }
    return {};
  }

  // True if a point can still win after the folds before `place`. Each remaining fold adds at least
  // its bound of the loss.
  bool open_after(std::size_t place, const GridPoint& at) const {
    GridScore least = part_[at.c];
    if (!choice_.open(at, least)) return false;
    for (; place < order_.size(); ++place) least.loss += folds_[order_[place]].least_loss(at);
    return choice_.open(at, least);
  }

  Status fold(std::size_t place, std::size_t member, std::size_t gamma) {
    FoldProblem& problem = folds_[order_[place]];
    const std::size_t before = alive_.size();
    for (std::size_t& c : alive_) {
      if (auto ok = add(part_[c], problem.score({member, gamma, c})); !ok) return ok;
      if (!open_after(place + 1, {member, gamma, c})) c = dropped;
    }
    std::erase(alive_, dropped);
    if (alive_.size() < before)
      std::rotate(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(place),
                  order_.begin() + static_cast<std::ptrdiff_t>(place) + 1);
    return {};
  }

  static constexpr std::size_t dropped = static_cast<std::size_t>(-1);
  FoldProblems& folds_;
  const TrainOptions& options_;
  Choice choice_;
  std::vector<std::size_t> order_;  // order of the folds
  std::vector<std::size_t> alive_;  // Cs still in the search for this member and gamma
  std::vector<GridScore> part_;     // per C: sum over the folds visited
};

void take(std::span<const int> sign, const std::vector<std::size_t>& rows, std::vector<int>& out) {
  out.clear();
  for (const std::size_t r : rows) out.push_back(sign[r]);
}

constexpr double rounding = 1e-9;
constexpr double float_rounding = 1e-7;  // rounding of the solvers' float kernel

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

Result<GridResult> GridSearch::run(const Matrix& rows, std::span<const int> sign,
                                   const Reducer& full, std::span<const Fold> folds,
                                   const TrainOptions& options, const RareT& rare) {
  problems_.resize(folds.size());
  for (std::size_t f = 0; f < folds.size(); ++f) {
    if (auto ok = check_fold(folds[f], sign, options); !ok) return pass(ok.error());
    if (options.nested)
      problems_[f].reset(rows, sign, Reducer::fit(rows, folds[f].train, sign, options, rare),
                         folds[f], options);
    else
      problems_[f].reset(rows, sign, full, folds[f], options);
  }
  GridResult result;
  const std::size_t members = full.sizes().size();
  const Status done = options.search == Search::fast
                          ? FastSearch(problems_, options, result).run(members)
                          : search_whole(problems_, members, options, result);
  if (!done) return pass(done.error());
  for (const FoldProblem& problem : problems_) result.fits += problem.fits();
  return result;
}

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
    std::size_t next = projected_.cols() + 1;  // next larger size in sizes_
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

// Upper bound of f(p) - f(n) over all pairs; useful where the kernel is nearly the identity.
double LossBound::farthest_apart(double c, double gamma) const {
  constexpr double useful_exponent = 2.0;  // with a larger kernel value the bound is useless
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
