#include "classifier/learners/tree_ensemble.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "classifier/base/parallel.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t most_trees = 1'000'000;

}  // namespace

std::vector<double> TreeEnsemble::sums(std::span<const double> features) const {
  std::vector<double> out(classes_, 0.0);
  for (const DecisionTree& tree : trees_) tree.add_shares(features, out);
  return out;
}

std::vector<double> TreeEnsemble::shares(std::span<const double> features) const {
  std::vector<double> out = sums(features);
  for (double& share : out) share /= static_cast<double>(trees_.size());
  return out;
}

Result<ClassScores> TreeEnsemble::predict(std::span<const double> features) const {
  if (auto ok = check_length(features, features_, "classify"); !ok) return pass(ok.error());
  const double trees = static_cast<double>(trees_.size());
  ClassScores out{0, sums(features)};
  out.winner = place_of_largest(out.score);
  for (double& sum : out.score) sum = std::log(std::max(sum, 0.5) / trees);
  return out;
}

Result<std::size_t> TreeEnsemble::classify(std::span<const double> features) const {
  if (auto ok = check_length(features, features_, "classify"); !ok) return pass(ok.error());
  return place_of_largest(sums(features));
}

std::vector<std::size_t> TreeEnsemble::used_columns() const {
  std::set<std::size_t> out;
  for (const DecisionTree& tree : trees_) tree.add_features(out);
  return {out.begin(), out.end()};
}

void TreeEnsemble::write(LineWriter& out) const {
  out.count("trees", trees_.size());
  for (const DecisionTree& tree : trees_) tree.write(out);
}

TreeEnsemble TreeEnsemble::read(LineReader& in, std::size_t features, std::size_t classes) {
  std::vector<DecisionTree> trees;
  for (std::size_t left = in.count("trees", 1, most_trees); in.ok() && left > 0; --left)
    trees.push_back(DecisionTree::read(in, features, classes));
  return {features, classes, std::move(trees)};
}

Result<std::vector<DecisionTree>> grow_trees(
    std::size_t trees, const TrainOptions& options,
    const std::function<DecisionTree(std::size_t tree)>& grow) {
  std::vector<DecisionTree> out(trees);
  std::vector<Status> status(trees);
  std::atomic<bool> stopped{false};
  parallel_for(trees, options.threads, [&](std::size_t t) {
    if (stopped) return;
    status[t] = unless_stopped(options.stop);
    if (!status[t]) {
      stopped = true;
      return;
    }
    out[t] = grow(t);
  });
  for (const Status& ok : status)
    if (!ok) return pass(ok.error());
  return out;
}

Result<TreeEnsemble> fit_extra_trees(const Matrix& rows, std::span<const std::size_t> of_row,
                                     std::size_t classes, const TrainOptions& options,
                                     std::size_t trees) {
  if (trees == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "fit_extra_trees",
                 .what = "too few trees",
                 .expected = "at least 1",
                 .got = "0"});
  if (rows.rows() == 0 || rows.rows() != of_row.size())
    return fail({.code = Errc::invalid_argument,
                 .where = "fit_extra_trees",
                 .what = "number of class numbers differs from the rows",
                 .expected = std::to_string(std::max<std::size_t>(rows.rows(), 1)),
                 .got = std::to_string(of_row.size())});
  const RankedRows ranked(rows, of_row, classes);
  const SplitRule rule{features_of_a_split(ranked.features()), true};
  std::vector<std::uint32_t> all(ranked.rows());
  std::iota(all.begin(), all.end(), 0U);
  auto grown = grow_trees(trees, options, [&](std::size_t t) {
    RandomEngine engine = engine_of_tree(options.seed, t);
    return DecisionTree::grow(ranked, all, rule, engine, {});
  });
  if (!grown) return pass(grown.error());
  return TreeEnsemble(ranked.features(), classes, std::move(*grown));
}

}  // namespace weft::classifier
