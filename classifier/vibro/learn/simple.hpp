#pragma once
// Gaussian naive Bayes and nearest neighbours.

#include <memory>

#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// A normal distribution per class and feature, variances widened by 1e-9 of the largest feature's,
/// priors from the training: scikit-learn's GaussianNB.
Result<std::unique_ptr<Classifier>> fit_naive_bayes(const Training& training);

/// Most frequent class among the five training rows that are nearest (Euclid), the lowest of
/// several; equally near ones in the order of the training.
Result<std::unique_ptr<Classifier>> fit_neighbours(const Training& training);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_naive_bayes(LineReader& in, std::size_t features,
                                             std::size_t classes);
/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_neighbours(LineReader& in, std::size_t features,
                                            std::size_t classes);

}  // namespace weft::classifier::vibro
