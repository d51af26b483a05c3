#pragma once
// libsvm with scikit-learn's default parameters.

#include <memory>

#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// C-SVC, one against one, RBF with C = 1 and gamma = 1 / (features x variance of all values): the
/// same as scikit-learn's SVC().
Result<std::unique_ptr<Classifier>> fit_svm(const Training& training);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_svm(LineReader& in, std::size_t features, std::size_t classes);

}  // namespace weft::classifier::vibro
