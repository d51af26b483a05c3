#pragma once
// The learners that tell fabrics apart, on any rows.

#include <memory>

#include "classifier/baseline/learner.hpp"
#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// train_recipe() of `learner` with its own defaults.
Result<std::unique_ptr<Classifier>> fit_fabric(const Training& training, Learner learner,
                                               const MethodOptions& options);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_fabric(LineReader& in, std::size_t features, std::size_t classes);

}  // namespace weft::classifier::vibro
