#include "classifier/vibro/importance.hpp"

#include <algorithm>
#include <string>

#include "classifier/base/interval.hpp"
#include "classifier/base/random.hpp"
#include "classifier/learners/class_folds.hpp"
#include "classifier/learners/learners.hpp"
#include "classifier/learners/outliers.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vote/novelty.hpp"

namespace weft::classifier::vibro {
namespace {

Result<double> measure_accuracy(const TrainedLearner& learner, const Matrix& rows,
                                std::span<const std::size_t> of_row) {
  std::size_t right = 0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const auto predicted = learner.classify(rows.row(r));
    if (!predicted) return pass(predicted.error(), "row " + std::to_string(r));
    right += *predicted == of_row[r] ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(rows.rows());
}

// Adds the permutation importance on one split, times `share`, to `sum`.
Status add_permuted(const FeatureMatrix& matrix, const Split& split, const Recipe& recipe,
                    const TrainOptions& options, std::size_t repeats, double share,
                    std::vector<Importance>& sum) {
  const auto trained = train_recipe(select_rows(matrix, split.train), recipe, options);
  if (!trained) return pass(trained.error());
  const auto own = class_numbers(select_rows(matrix, split.test), trained->labels());
  if (!own) return pass(own.error());
  const auto permuted =
      permutation_importance(*trained, matrix.values.take(split.test), *own, repeats, options.seed);
  if (!permuted) return pass(permuted.error());
  for (std::size_t f = 0; f < sum.size(); ++f) {
    sum[f].mean += share * (*permuted)[f].mean;
    sum[f].deviation += share * (*permuted)[f].deviation;
  }
  return {};
}

// The folds of a split's training rows as splits of the matrix; without folds one split with all of
// them on both sides.
std::vector<Split> inner_splits(const FeatureMatrix& matrix, const Split& outer,
                                const TrainOptions& options) {
  std::vector<Split> out;
  for (const Fold& fold : class_folds(select_rows(matrix, outer.train), options).folds) {
    Split& split = out.emplace_back();
    for (const std::size_t i : fold.train) split.train.push_back(outer.train[i]);
    for (const std::size_t i : fold.validate) split.test.push_back(outer.train[i]);
  }
  if (out.empty()) out.push_back({outer.train, outer.train});
  return out;
}

// Columns selected on the training windows of one split; its test windows are not used.
Result<std::vector<std::size_t>> selected(const WindowSet& windows, const Split& split,
                                          const Recipe& recipe, const TrainOptions& options,
                                          std::size_t count, std::size_t repeats) {
  const std::vector<Split> parts = inner_splits(windows.matrix, split, options);
  std::vector<Importance> sum(windows.matrix.names.size());
  for (const Split& part : parts)
    if (auto ok = add_permuted(windows.matrix, part, recipe, options, repeats,
                               1.0 / static_cast<double>(parts.size()), sum);
        !ok)
      return pass(ok.error());
  return most_important(sum, count);
}

WindowSet with_columns(const WindowSet& windows, std::span<const std::size_t> columns) {
  WindowSet out = windows;
  const Matrix& all = windows.matrix.values;
  out.matrix.values.assign(all.rows(), columns.size());
  out.matrix.names.clear();
  for (std::size_t k = 0; k < columns.size(); ++k) {
    out.matrix.names.push_back(windows.matrix.names[columns[k]]);
    for (std::size_t r = 0; r < all.rows(); ++r) out.matrix.values(r, k) = all(r, columns[k]);
  }
  return out;
}

// Adds the result of one split.
Status add_reached(const WindowSet& windows, const Split& split, const Recipe& recipe,
                   const TrainOptions& options, std::vector<std::size_t> columns, Reached& out) {
  const auto got = cross_validate(with_columns(windows, columns), std::span(&split, 1),
                                  std::span(&recipe, 1), options);
  if (!got) return pass(got.error());
  out.split_accuracy.push_back(got->accuracy);
  const auto n = static_cast<double>(out.split_accuracy.size());
  out.accuracy += (got->accuracy - out.accuracy) / n;
  out.f_score += (got->f_score - out.f_score) / n;
  out.retained.push_back(std::move(columns));
  return {};
}

}  // namespace

Result<std::vector<Importance>> permutation_importance(const TrainedLearner& learner,
                                                       const Matrix& rows,
                                                       std::span<const std::size_t> of_row,
                                                       std::size_t repeats, std::uint64_t seed) {
  if (rows.rows() == 0 || of_row.size() != rows.rows() || repeats == 0)
    return fail({.code = Errc::invalid_argument,
                 .what = "no rows, a row without class or no repeats for the importance"});
  const auto whole = measure_accuracy(learner, rows, of_row);
  if (!whole) return pass(whole.error());
  RandomEngine engine(seed);
  std::vector<Importance> out;
  Matrix assigned = rows;
  for (std::size_t f = 0; f < rows.cols(); ++f) {
    std::vector<double> column, lost;
    for (std::size_t r = 0; r < rows.rows(); ++r) column.push_back(rows(r, f));
    for (std::size_t i = 0; i < repeats; ++i) {
      shuffle(column, engine);
      for (std::size_t r = 0; r < rows.rows(); ++r) assigned(r, f) = column[r];
      const auto left = measure_accuracy(learner, assigned, of_row);
      if (!left) return pass(left.error());
      lost.push_back(*whole - *left);
    }
    for (std::size_t r = 0; r < rows.rows(); ++r) assigned(r, f) = rows(r, f);
    out.push_back({compute_mean(lost), compute_deviation(lost)});
  }
  return out;
}

Result<Weighed> weigh_features(const WindowSet& windows, std::span<const Split> splits,
                               const Recipe& recipe, const TrainOptions& options,
                               std::size_t repeats) {
  if (splits.empty())
    return fail({.code = Errc::invalid_argument, .what = "no splits for the feature importance"});
  const std::size_t features = windows.matrix.names.size();
  Weighed out{std::vector<Importance>(features), std::vector<double>(features, 0.0)};
  const double share = 1.0 / static_cast<double>(splits.size());
  for (const Split& split : splits) {
    if (auto ok =
            add_permuted(windows.matrix, split, recipe, options, repeats, share, out.permutation);
        !ok)
      return pass(ok.error());
    FeatureMatrix rows = select_rows(windows.matrix, split.train);
    if (auto ok = remove_outliers(rows, options.outliers); !ok) return pass(ok.error());
    const Classes classes = find_classes(rows);
    const auto grown = forest_importance({rows, classes}, options);
    if (!grown) return pass(grown.error());
    for (std::size_t f = 0; f < features; ++f) out.forest[f] += share * (*grown)[f];
  }
  return out;
}

Result<Reached> reach_by_selection(const WindowSet& windows, std::span<const Split> splits,
                                   const Recipe& recipe, const TrainOptions& options,
                                   std::size_t count, std::size_t repeats) {
  if (splits.empty() || count == 0)
    return fail(
        {.code = Errc::invalid_argument, .what = "no splits or no features for the selection"});
  Reached out;
  for (const Split& split : splits) {
    auto columns = selected(windows, split, recipe, options, count, repeats);
    if (!columns) return pass(columns.error());
    if (auto ok = add_reached(windows, split, recipe, options, std::move(*columns), out); !ok)
      return pass(ok.error());
  }
  return out;
}

Result<Reached> reach_with(const WindowSet& windows, std::span<const Split> splits,
                           const Recipe& recipe, const TrainOptions& options,
                           std::span<const std::size_t> columns) {
  if (splits.empty() || columns.empty())
    return fail({.code = Errc::invalid_argument, .what = "no splits or no columns to evaluate"});
  Reached out;
  for (const Split& split : splits)
    if (auto ok =
            add_reached(windows, split, recipe, options, {columns.begin(), columns.end()}, out);
        !ok)
      return pass(ok.error());
  return out;
}

std::vector<std::size_t> most_important(std::span<const Importance> importance, std::size_t count,
                                        std::span<const double> ties) {
  std::vector<std::size_t> out = numbers_below(importance.size());
  std::stable_sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
    if (importance[a].mean != importance[b].mean) return importance[a].mean > importance[b].mean;
    return !ties.empty() && ties[a] > ties[b];
  });
  out.resize(std::min(count, out.size()));
  return out;
}

}  // namespace weft::classifier::vibro
