#pragma once
// One decision tree, and a forest of them, as learners of the 2023 paper.

#include <cstddef>
#include <memory>
#include <vector>

#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// Of one tree that looks at all features.
Result<std::unique_ptr<Classifier>> fit_tree(const Training& training,
                                             const MethodOptions& options);
/// The mean of the trees' shares.
Result<std::unique_ptr<Classifier>> fit_forest(const Training& training,
                                               const MethodOptions& options);

/// What the write() of a tree or a forest wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_trees(LineReader& in, std::size_t features, std::size_t classes);

/// Mean over the trees of a forest of what each feature took off the impurity; sum 1. This is how
/// the paper ranked its ten features.
Result<std::vector<double>> forest_importance(const Training& training,
                                              const MethodOptions& options);

}  // namespace weft::classifier::vibro
