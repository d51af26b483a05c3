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
#include "classifier/imprint/scale_features.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::imprint {

// Whether classes are linearly separable at all, said next to a perceptron that stops after 1000
// rounds (choice E5).

enum class Separability {
  separable,      ///< proved: weights were found that take every row for its class
  not_separable,  ///< proved, to a margin of 1e-7: see separability()
  undecided       ///< the work allowed did not suffice
};
std::string_view to_string(Separability verdict);

struct SeparabilityOutcome {
  Separability verdict = Separability::undecided;
  /// Least distance from the origin that the hull was shown to keep, 0 where it has it inside.
  double margin = 0;
  std::size_t steps = 0;
};

/// Kesler's construction makes one vector of every row and wrong class; classes are separable if
/// and only if one direction has a positive product with all of them, that is if their convex hull
/// does not contain the origin. The hull's point nearest to the origin is found by Wolfe's
/// algorithm (Wolfe 1976, Mathematical Programming 11) on unit vectors of z-scored rows with a
/// bias: scaling changes nothing about separability. `separable` is checked row by row with the
/// weights found; `not_separable` is a convex combination of unit vectors that is at most 1e-7
/// long. Refuses what check_training() refuses.
Result<SeparabilityOutcome> separability(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::size_t most_steps = 20000);

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

/// What learns.
enum class Rule {
  kesler,         ///< the paper's perceptron on the features as they are
  kesler_zscore,  ///< on scaled features (choice E5)
  least_squares,  ///< minimum squared error, on scaled features
  cores,          ///< RBF cores of Khan et al. 2016, features with p < delta
  cores_all,      ///< RBF cores, all features
  lda,            ///< shrinkage LDA
  svc             ///< one multi-class SVC
};
inline constexpr std::array all_rules{Rule::kesler, Rule::kesler_zscore, Rule::least_squares,
                                      Rule::cores,  Rule::cores_all,     Rule::lda,
                                      Rule::svc};
std::string_view to_string(Rule rule);

struct ExperimentOutcome {
  bool converged = true;    ///< of a perceptron: in every round; false is the paper's infinity
  std::size_t correct = 0;  ///< where it did not converge: in the rounds before
  std::size_t total = 0;
  std::size_t most_rounds = 0;     ///< of a perceptron: over the data, in its longest training
  std::size_t failed = 0;          ///< trainings that did not converge
  std::vector<std::size_t> wrong;  ///< rows taken for another class, in the order of the rounds
};

/// Ends with the first training that does not converge, for then convergence has failed. Refuses
/// what test_rounds(), check_rounds() and the rule refuse.
Result<ExperimentOutcome> run_experiment(const FeatureMatrix& matrix, Experiment experiment,
                                         Rule rule);

}  // namespace weft::classifier::imprint
