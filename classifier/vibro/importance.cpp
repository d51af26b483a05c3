#include "classifier/vibro/importance.hpp"

#include <algorithm>
#include <numeric>
#include <set>
#include <string>

#include "classifier/evaluate/interval.hpp"
#include "classifier/learn/random.hpp"
#include "classifier/vibro/learn/tree.hpp"

namespace weft::classifier::vibro {
namespace {

Result<double> accuracy_of(const Pipeline& pipeline, const Matrix& rows,
                           std::span<const std::size_t> of_row) {
  std::size_t right = 0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const auto said = pipeline.classify(rows.row(r));
    if (!said) return pass(said.error(), "row " + std::to_string(r));
    right += *said == of_row[r] ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(rows.rows());
}

// By the sorted labels.
std::vector<std::size_t> classes_in(const WindowSet& windows, const std::set<std::string>& labels,
                                    std::span<const std::size_t> rows) {
  std::vector<std::size_t> out;
  for (const std::size_t r : rows)
    out.push_back(static_cast<std::size_t>(
        std::distance(labels.begin(), labels.find(windows.matrix.labels[r]))));
  return out;
}

}  // namespace

Result<std::vector<Importance>> permutation_importance(const Pipeline& pipeline, const Matrix& rows,
                                                       std::span<const std::size_t> of_row,
                                                       std::size_t repeats, std::uint64_t seed) {
  if (rows.rows() == 0 || of_row.size() != rows.rows() || repeats == 0)
    return fail(Errc::invalid_argument, "importance needs rows with a class each, and a repeat");
  const auto whole = accuracy_of(pipeline, rows, of_row);
  if (!whole) return pass(whole.error());
  RandomEngine engine(seed);
  std::vector<Importance> out;
  Matrix dealt = rows;
  for (std::size_t f = 0; f < rows.cols(); ++f) {
    std::vector<double> column, lost;
    for (std::size_t r = 0; r < rows.rows(); ++r) column.push_back(rows(r, f));
    for (std::size_t i = 0; i < repeats; ++i) {
      shuffle(column, engine);
      for (std::size_t r = 0; r < rows.rows(); ++r) dealt(r, f) = column[r];
      const auto left = accuracy_of(pipeline, dealt, of_row);
      if (!left) return pass(left.error());
      lost.push_back(*whole - *left);
    }
    for (std::size_t r = 0; r < rows.rows(); ++r) dealt(r, f) = rows(r, f);
    out.push_back({mean_of(lost), deviation_of(lost)});
  }
  return out;
}

Result<Weighed> weigh_features(const WindowSet& windows, std::span<const Split> splits,
                               const PipelineOptions& options, std::size_t repeats) {
  if (splits.empty()) return fail(Errc::invalid_argument, "no split to weigh features on");
  const std::size_t features = windows.matrix.names.size();
  const std::set<std::string> labels(windows.matrix.labels.begin(), windows.matrix.labels.end());
  Weighed out{std::vector<Importance>(features), std::vector<double>(features, 0.0)};
  const double share = 1.0 / static_cast<double>(splits.size());
  for (const Split& split : splits) {
    const auto of_train = classes_in(windows, labels, split.train);
    const auto of_test = classes_in(windows, labels, split.test);
    const Matrix train = windows.matrix.values.take(split.train);
    const Training training{&train, of_train, labels.size()};
    const auto pipeline = Pipeline::train(training, options);
    if (!pipeline) return pass(pipeline.error());
    const auto permuted = permutation_importance(*pipeline, windows.matrix.values.take(split.test),
                                                 of_test, repeats, options.learner.seed);
    if (!permuted) return pass(permuted.error());
    const auto grown = forest_importance(training, options.learner);
    if (!grown) return pass(grown.error());
    for (std::size_t f = 0; f < features; ++f) {
      out.permutation[f].mean += share * (*permuted)[f].mean;
      out.permutation[f].deviation += share * (*permuted)[f].deviation;
      out.forest[f] += share * (*grown)[f];
    }
  }
  return out;
}

std::vector<std::size_t> most_important(std::span<const Importance> importance, std::size_t count) {
  std::vector<std::size_t> out(importance.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  std::stable_sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
    return importance[a].mean > importance[b].mean;
  });
  out.resize(std::min(count, out.size()));
  return out;
}

}  // namespace weft::classifier::vibro
