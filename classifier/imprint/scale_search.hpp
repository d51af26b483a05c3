#pragma once
// The search of scale space that Ellis 1986, section 4, leaves to others: which scales of smoothing
// tell the classes apart best.

#include <span>
#include <vector>

#include "classifier/imprint/experiments.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/scale_features.hpp"

namespace weft::classifier::imprint {

struct ScaleSearchOptions {
  std::vector<double> sigmas = {0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6};
  std::size_t most_scales = 3;
  Form form = Form::full;
  Rule rule = Rule::least_squares;
  Experiment evaluated_by = Experiment::object_of_all;  ///< an object that was never seen
  std::size_t threads = 0;
};

struct ScaleScore {
  std::vector<double> sigmas;
  ExperimentOutcome outcome;
};

/// Every set of one to most_scales of the scales, best first: most right answers, none where a
/// training did not converge; then fewer scales; then in the order given. The
/// imprints are those to learn from: what is found on them says nothing about their own accuracy.
/// Refuses what ScaleFeatures and run_experiment() refuse, no set, and more than 2000 of them.
Result<std::vector<ScaleScore>> search_scales(std::span<const Imprint> imprints,
                                              const ScaleSearchOptions& options);

}  // namespace weft::classifier::imprint
