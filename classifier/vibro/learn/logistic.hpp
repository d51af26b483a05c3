#pragma once
// Multinomial logistic regression.

#include <memory>

#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// Softmax of linear scores; minimises the sum of the rows' cross entropies plus half the squared
/// weights (C = 1; not the intercepts) by L-BFGS until no slope is above 1e-4: scikit-learn's
/// LogisticRegression(max_iter=1000). liblinear has one class against the others only.
Result<std::unique_ptr<Classifier>> fit_logistic(const Training& training);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_logistic(LineReader& in, std::size_t features,
                                          std::size_t classes);

}  // namespace weft::classifier::vibro
