#include "classifier/fabric/grid_search.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <tuple>

#include "classifier/learn/distance.hpp"
#include "classifier/learn/svm.hpp"

namespace weft::classifier {
namespace {

std::vector<int> take(std::span<const int> sign, const std::vector<std::size_t>& rows) {
  std::vector<int> out;
  out.reserve(rows.size());
  for (const std::size_t r : rows) out.push_back(sign[r]);
  return out;
}

GridScore score(const SvmSolution& svm, const Matrix& kernel, const std::vector<int>& sign) {
  GridScore out;
  for (std::size_t v = 0; v < kernel.rows(); ++v) {
    double f = svm.bias;
    for (std::size_t i = 0; i < kernel.cols(); ++i) f += svm.coefficient[i] * kernel(v, i);
    if ((f > 0.0) != (sign[v] > 0)) ++out.errors;
    out.loss += std::max(0.0, 1.0 - sign[v] * f);
  }
  return out;
}

Status check_fold(const Fold& fold, std::span<const int> sign, const TrainOptions& options) {
  bool positive = false, negative = false;
  for (const auto* rows : {&fold.train, &fold.validate}) {
    for (const std::size_t r : *rows) {
      if (r >= sign.size()) {
        return fail(Errc::range, "fold names a row that does not exist", "folds",
                    "< " + std::to_string(sign.size()), std::to_string(r));
      }
    }
  }
  for (const std::size_t r : fold.train) (sign[r] > 0 ? positive : negative) = true;
  if (!positive || !negative)
    return fail(Errc::invalid_argument, "fold trains on one class only", "folds");
  if (options.nested && options.reduction == Reduction::pvalue &&
      fold.train.size() < least_fold_rows) {
    return fail(Errc::invalid_argument, "fold is too small to select features in", "folds",
                "at least " + std::to_string(least_fold_rows) + " training rows",
                std::to_string(fold.train.size()), "Use fewer validation rows or nested = false");
  }
  return {};
}

// One fold: every distinct number of directions is solved once and counted for every member that
// has it.
class FoldSearch {
 public:
  FoldSearch(const Matrix& rows, std::span<const int> sign, const Reducer& reducer,
             const Fold& fold, const TrainOptions& options)
      : options_(options),
        sizes_(reducer.sizes()),
        train_(reducer.project(rows.take(fold.train))),
        validate_(reducer.project(rows.take(fold.validate))),
        sign_(take(sign, fold.validate)),
        trainer_(take(sign, fold.train)) {}

  Status add_to(GridResult& result) {
    Matrix tt(train_.rows(), train_.rows());
    Matrix vt(validate_.rows(), train_.rows());
    std::size_t done = 0;
    for (const std::size_t size : std::set<std::size_t>(sizes_.begin(), sizes_.end())) {
      add_squared_distances(train_, train_, done, size, tt);
      add_squared_distances(validate_, train_, done, size, vt);
      done = size;
      if (auto ok = add_size(size, tt, vt, result); !ok) return ok;
    }
    return {};
  }

 private:
  Status add_size(std::size_t size, const Matrix& tt, const Matrix& vt, GridResult& result) {
    for (std::size_t g = 0; g < options_.grid.gamma.size(); ++g) {
      if (auto ok = trainer_.set_kernel(rbf(tt, options_.grid.gamma[g])); !ok) return ok;
      const Matrix kernel = rbf(vt, options_.grid.gamma[g]);
      for (std::size_t c = 0; c < options_.grid.c.size(); ++c) {
        const auto svm = trainer_.solve(options_.grid.c[c], options_.tolerance);
        if (!svm) return pass(svm.error());
        ++result.fits;
        count(size, g, c, score(*svm, kernel, sign_), result);
      }
    }
    return {};
  }

  void count(std::size_t size, std::size_t g, std::size_t c, const GridScore& s,
             GridResult& result) const {
    const std::size_t gammas = options_.grid.gamma.size();
    for (std::size_t m = 0; m < sizes_.size(); ++m) {
      if (sizes_[m] != size) continue;
      GridScore& sum = result.scores[(m * gammas + g) * options_.grid.c.size() + c];
      sum.errors += s.errors;
      sum.loss += s.loss;
    }
  }

  const TrainOptions& options_;
  const std::vector<std::size_t> sizes_;
  const Matrix train_;
  const Matrix validate_;
  const std::vector<int> sign_;
  SvmTrainer trainer_;
};

// Fewest errors, then (Tie::loss) smallest loss to 1e-9, smallest C, gamma, and first member.
void choose(const TrainOptions& options, std::size_t members, GridResult& result) {
  using Key = std::tuple<std::size_t, double, double, double, std::size_t>;
  const auto& grid = options.grid;
  bool any = false;
  Key best;
  for (std::size_t m = 0; m < members; ++m) {
    for (std::size_t g = 0; g < grid.gamma.size(); ++g) {
      for (std::size_t c = 0; c < grid.c.size(); ++c) {
        const GridScore& s = result.scores[(m * grid.gamma.size() + g) * grid.c.size() + c];
        const double loss = options.tie == Tie::loss ? std::nearbyint(s.loss * 1e9) : 0.0;
        const Key key{s.errors, loss, grid.c[c], grid.gamma[g], m};
        if (any && !(key < best)) continue;
        any = true;
        best = key;
        std::tie(result.member, result.gamma, result.c, result.best) = std::tie(m, g, c, s);
      }
    }
  }
}

}  // namespace

Result<GridResult> search_grid(const Matrix& rows, std::span<const int> sign, const Reducer& full,
                               std::span<const Fold> folds, const TrainOptions& options) {
  GridResult result;
  const std::size_t members = full.sizes().size();
  result.scores.resize(members * options.grid.gamma.size() * options.grid.c.size());
  for (const Fold& fold : folds) {
    if (auto ok = check_fold(fold, sign, options); !ok) return pass(ok.error());
    const Reducer reducer =
        options.nested ? Reducer::fit(rows.take(fold.train), take(sign, fold.train), options)
                       : full;
    if (auto ok = FoldSearch(rows, sign, reducer, fold, options).add_to(result); !ok) {
      return pass(ok.error());
    }
  }
  choose(options, members, result);
  return result;
}

}  // namespace weft::classifier
