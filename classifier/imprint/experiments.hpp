#pragma once
// The four experiments of Ellis 1986, section 3.4: some imprints are set aside, a rule learns the
// others and says of what class those are; until all were aside once.

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
/// As the paper prints them: "1/N".
std::string_view to_string(Experiment experiment);

/// Rows to set aside, round by round. Objects and classes count in the order of their first row; of
/// classes with more imprints (objects) than the smallest one, the last are never aside. Refuses
/// lists of different length and an object of two classes.
Result<std::vector<std::vector<std::size_t>>> test_rounds(Experiment experiment,
                                                          std::span<const std::string> labels,
                                                          std::span<const std::string> objects);

/// Refuses rounds of `labels` that leave a class no imprint to learn from: its imprints can only be
/// answered wrongly.
Status check_rounds(const std::vector<std::vector<std::size_t>>& rounds,
                    std::span<const std::string> labels);

/// What learns in the tables: the paper's perceptron, on scaled features too (choice E5), minimum
/// squared error and ridge regression, and ours.
inline constexpr std::array table_learners{Learner::perceptron,    Learner::perceptron_zscore,
                                           Learner::least_squares, Learner::ridge,
                                           Learner::pvalue,        Learner::all,
                                           Learner::lda,           Learner::svc};

struct ExperimentOutcome {
  bool converged = true;    ///< of a perceptron: in every round; false is the paper's infinity
  std::size_t correct = 0;  ///< where it did not converge: in the rounds before
  std::size_t total = 0;
  std::size_t most_rounds = 0;  ///< of a perceptron: over the data, in its longest training
  std::size_t trainings = 0;
  std::size_t failed = 0;              ///< trainings that did not converge
  std::vector<std::size_t> wrong;      ///< rows taken for another class, in the order of the rounds
  std::vector<std::string> taken_for;  ///< class that each of them was taken for
};

enum class OnFailure {
  stop,  ///< end with the first training that does not converge: then convergence has failed
  count  ///< make every training; those that do not converge are asked nothing
};

/// Refuses what test_rounds(), check_rounds() and the rule refuse.
Result<ExperimentOutcome> run_experiment(const FeatureMatrix& matrix, Experiment experiment,
                                         Learner rule, OnFailure on_failure = OnFailure::stop);

// The search of scale space that Ellis 1986, section 4, leaves to others: which scales of smoothing
// tell the classes apart best.

struct ScaleSearchOptions {
  std::vector<double> sigmas = {0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 8};
  std::size_t most_scales = 3;
  Form form = Form::full;
  Learner rule = Learner::least_squares;
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
