#pragma once
// A small feed-forward network.

#include <cstddef>
#include <memory>
#include <vector>

#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// Layers of ReLU, softmax at the end, cross entropy with 1e-4 of the squared weights, Adam with
/// steps of 1e-3 on shuffled batches of 200, until the loss of ten passes in a row is not 1e-4
/// below the best, or after 1000 passes: scikit-learn's MLPClassifier(hidden, max_iter=1000), in
/// single precision. Features should be scaled.
Result<std::unique_ptr<Classifier>> fit_network(const Training& training,
                                                const std::vector<std::size_t>& hidden,
                                                const MethodOptions& options);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_network(LineReader& in, std::size_t features, std::size_t classes);

}  // namespace weft::classifier::vibro
