#include "classifier/fabric/reducer.hpp"

#include <algorithm>

#include "classifier/selection/selection.hpp"

namespace weft::classifier {
namespace {

Matrix take(const Matrix& rows, std::span<const std::size_t> which,
            std::span<const std::size_t> columns) {
  Matrix out(which.size(), columns.size());
  for (std::size_t r = 0; r < which.size(); ++r) {
    const auto row = rows.row(which[r]);
    for (std::size_t k = 0; k < columns.size(); ++k) out(r, k) = row[columns[k]];
  }
  return out;
}

template <class T>
std::vector<T> first(const std::vector<T>& items, std::size_t count) {
  return {items.begin(), items.begin() + static_cast<std::ptrdiff_t>(count)};
}

Matrix first_rows(const Matrix& rows, std::size_t count) {
  return rows.take(numbers_below(count));
}

// Ranked features, as many as the largest delta admits, with the size for every delta.
struct Subset {
  std::vector<std::size_t> columns;
  std::vector<std::size_t> sizes;
  std::vector<double> t, df;  // one per column
};

// Ranks columns by log p, which still differs where p underflows; t is not comparable, as the
// degrees of freedom differ.
Subset welch_subset(const Matrix& rows, std::span<const std::size_t> which,
                    std::span<const int> sign, const TrainOptions& options) {
  const WelchTest test = welch_statistics(rows, which, sign);
  const std::vector<std::size_t> ranked = rank_by_t(test.log_p, options.cap);
  Subset out;
  for (const double delta : options.grid.delta)
    out.sizes.push_back(subset_size(test.log_p, ranked, delta, options.cap));
  out.columns = first(ranked, std::ranges::max(out.sizes));
  for (const std::size_t k : out.columns) {
    out.t.push_back(test.t[k]);
    out.df.push_back(test.df[k]);
  }
  return out;
}

Subset ranked_subset(const Matrix& rows, std::span<const std::size_t> which,
                     std::span<const int> sign, const TrainOptions& options, const RareT& rare) {
  if (options.t_test == TTest::welch) return welch_subset(rows, which, sign, options);
  const std::vector<double> t = t_statistics(rows, which, sign);
  const std::vector<std::size_t> ranked = rank_by_t(t, options.cap);
  const double df = static_cast<double>(which.size()) - 2.0;
  Subset out;
  for (const double delta : options.grid.delta) {
    out.sizes.push_back(subset_size(t, ranked, df, delta, options.cap, rare));
  }
  out.columns = first(ranked, *std::max_element(out.sizes.begin(), out.sizes.end()));
  for (const std::size_t k : out.columns) out.t.push_back(t[k]);
  out.df.assign(out.t.size(), df);
  return out;
}

}  // namespace

Reducer::Reducer(std::vector<std::size_t> columns, Scaler scaler, Matrix axes)
    : columns_(std::move(columns)),
      scaler_(std::move(scaler)),
      axes_(std::move(axes)),
      sizes_{directions()} {}

Reducer Reducer::fit(const Matrix& rows, std::span<const int> sign, const TrainOptions& options,
                     const RareT& rare) {
  return fit(rows, numbers_below(rows.rows()), sign, options, rare);
}

Reducer Reducer::fit(const Matrix& rows, std::span<const std::size_t> which,
                     std::span<const int> sign, const TrainOptions& options, const RareT& rare) {
  if (options.reduction == Reduction::pvalue) {
    Subset subset = ranked_subset(rows, which, sign, options, rare);
    Scaler scaler = fit_scaler(take(rows, which, subset.columns));
    Reducer out(std::move(subset.columns), std::move(scaler), {});
    out.sizes_ = std::move(subset.sizes);
    out.t_ = std::move(subset.t);
    out.df_ = std::move(subset.df);
    return out;
  }
  const Matrix taken = rows.take(which);
  Scaler scaler = fit_scaler(taken);
  if (options.reduction == Reduction::all)
    return {numbers_below(rows.cols()), std::move(scaler), {}};
  PcaBasis basis = pca_basis(scaled(scaler, taken), options.cap);
  std::vector<std::size_t> sizes;
  for (const double share : options.grid.explained) sizes.push_back(components_for(basis, share));
  Reducer out(numbers_below(rows.cols()), std::move(scaler), std::move(basis.axes));
  out.sizes_ = std::move(sizes);
  return out;
}

void Reducer::project(std::span<const double> features, std::span<double> out) const {
  if (axes_.rows() == 0) {
    for (std::size_t k = 0; k < columns_.size(); ++k)
      out[k] = scaler_.apply(k, features[columns_[k]]);
    return;
  }
  std::fill(out.begin(), out.end(), 0.0);
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const double z = scaler_.apply(k, features[columns_[k]]);
    for (std::size_t c = 0; c < axes_.rows(); ++c) out[c] += z * axes_(c, k);
  }
}

Matrix Reducer::project(const Matrix& rows) const {
  Matrix out(rows.rows(), directions());
  for (std::size_t r = 0; r < rows.rows(); ++r) project(rows.row(r), out.row(r));
  return out;
}

void Reducer::project(const Matrix& rows, std::span<const std::size_t> first,
                      std::span<const std::size_t> second, Matrix& out) const {
  out.assign(first.size() + second.size(), directions());
  std::size_t to = 0;
  for (const auto& which : {first, second})
    for (const std::size_t r : which) project(rows.row(r), out.row(to++));
}

Reducer Reducer::truncated(std::size_t directions) const {
  if (axes_.rows() > 0) return {columns_, scaler_, first_rows(axes_, directions)};
  Reducer out(first(columns_, directions),
              {first(scaler_.mean, directions), first(scaler_.deviation, directions)}, {});
  if (!t_.empty()) out.t_ = first(t_, directions);
  if (!df_.empty()) out.df_ = first(df_, directions);
  return out;
}

}  // namespace weft::classifier
