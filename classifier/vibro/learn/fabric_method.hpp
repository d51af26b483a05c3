#pragma once
// The learners that tell fabrics apart, on any rows.

#include <memory>

#include "classifier/baseline/learner.hpp"
#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// train_recipe() of `learner` with its own defaults.
Result<std::unique_ptr<Classifier>> fit_fabric(const Training& training, Learner learner,
                                               const MethodOptions& options);

}  // namespace weft::classifier::vibro
