#pragma once
// The four experiments of Ellis 1986, section 3.4. Some imprints are set aside, a rule trains on
// the others and predicts their class; this repeats until every imprint was set aside once.

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/scale_features.hpp"
#include "classifier/learners/learner.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::imprint {

enum class Experiment {
  one_of_all,       ///< 1/N: one imprint
  object_of_all,    ///< 2/N: all imprints of one object
  one_of_class,     ///< 1/CLASS: the k-th imprint of each class (choice E9)
  object_of_class,  ///< 2/CLASS: all imprints of the k-th object of each class (E9)
};
inline constexpr std::array all_experiments{Experiment::one_of_all, Experiment::object_of_all,
                                            Experiment::one_of_class, Experiment::object_of_class};
/// The notation of the paper: "1/N".
std::string_view to_string(Experiment experiment);

/// Rows to set aside in each round. Objects and classes count in the order of their first row. If a
/// class has more imprints (objects) than the smallest one, its last ones are never set aside.
/// Refuses lists of different length and an object of two classes.
Result<std::vector<std::vector<std::size_t>>> test_rounds(Experiment experiment,
                                                          std::span<const std::string> labels,
                                                          std::span<const std::string> objects);

/// Refuses rounds of `labels` that leave a class without a training imprint: the predictions of its
/// imprints could only be wrong.
Status check_rounds(const std::vector<std::vector<std::size_t>>& rounds,
                    std::span<const std::string> labels);

/// Learners in the tables: the paper's perceptron, also on scaled features (choice E5), minimum
/// squared error, ridge regression, and our own.
inline constexpr std::array table_learners{Learner::perceptron,    Learner::perceptron_zscore,
                                           Learner::least_squares, Learner::ridge,
                                           Learner::pvalue,        Learner::all,
                                           Learner::lda,           Learner::svc};

struct ExperimentOutcome {
  bool converged = true;    ///< for a perceptron: in every round; false is the paper's infinity
  std::size_t correct = 0;  ///< if not converged: in the rounds before
  std::size_t total = 0;
  std::size_t most_rounds = 0;  ///< for a perceptron: rounds over the data in its longest training
  std::size_t trainings = 0;
  std::size_t failed = 0;              ///< trainings that did not converge
  std::vector<std::size_t> wrong;      ///< rows with a wrong prediction, in the order of the rounds
  std::vector<std::string> taken_for;  ///< the predicted class of each of them
};

enum class OnFailure {
  stop,  ///< end at the first training that does not converge: then convergence has failed
  count  ///< make every training; those that do not converge predict nothing
};

/// Refuses what test_rounds(), check_rounds() and the rule refuse.
Result<ExperimentOutcome> run_experiment(const FeatureMatrix& matrix, Experiment experiment,
                                         Learner rule, OnFailure on_failure = OnFailure::stop);

// The search of scale space that Ellis 1986, section 4, leaves open: which scales of smoothing
// separate the classes best.

struct ScaleSearchOptions {
  std::vector<double> sigmas = {0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 8};
  std::size_t most_scales = 3;
  Form form = Form::full;
  Learner rule = Learner::least_squares;
  Experiment evaluated_by = Experiment::object_of_all;  ///< tests objects outside the training
  std::size_t threads = 0;
};

struct ScaleScore {
  std::vector<double> sigmas;
  ExperimentOutcome outcome;
};

/// Scores every set of one to most_scales of the scales, best first: most right predictions (none
/// if a training did not converge), then fewer scales, then the given order. Use training imprints
/// only: the result gives no accuracy on these imprints. Refuses what ScaleFeatures and
/// run_experiment() refuse, no set, and more than 2000 sets.
Result<std::vector<ScaleScore>> search_scales(std::span<const Imprint> imprints,
                                              const ScaleSearchOptions& options);

}  // namespace weft::classifier::imprint
