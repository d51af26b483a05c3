#pragma once
// A probability per fabric from the decision values of the cores: held-out decisions on training
// trials, sigmoids fitted to them, and the coupling of pairs.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/vote/vote.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Decisions of cores on held-out training trials. Calibration and reject rule are fitted to these,
// never to the fit of the training trials themselves.

/// Decisions on training rows, each by a core that was trained without the row.
struct CrossDecisions {
  std::vector<std::size_t> own;  ///< per row: its class
  /// [rows x classes]: f of the core of the row's own class against the column's class, positive in
  /// favour of the own class; 0 in the own column.
  Matrix against;

  /// [rows x cores]: all cores' decisions on `rows`, in the order of model.pairs(). They are
  /// held-out decisions for cores of a row's own class; the other cores have never seen the row.
  /// `values` are those of the training.
  [[nodiscard]] Matrix of_rows(const FabricModel& model, const Matrix& values,
                               std::span<const std::size_t> rows, std::size_t threads = 0) const;
};

/// Trains every core again on each of its folds with its chosen parameters; the new core decides
/// the held-out rows. `matrix` and `options` must be those of the training, so that the folds are
/// the same. A row that no fold holds out keeps 0. Features are selected inside each fold. Refuses
/// other columns or labels than the model's.
Result<CrossDecisions> cross_decisions(const FabricModel& model, const FeatureMatrix& matrix,
                                       const TrainOptions& options);

// Converts a core's decision value to the probability of its first class (Platt 2000, with the
// numerics of Lin, Lin and Weng 2007).

/// p(f) = 1 / (1 + exp(slope f + offset)), slope <= 0: a larger f never makes class a less likely.
struct Sigmoid {
  double slope = 0.0;
  double offset = 0.0;

  /// In [0, 1]; never NaN for finite f, slope and offset.
  [[nodiscard]] double operator()(double f) const;
};

/// Maximum likelihood on held-out decision values, with Platt's targets (n+ + 1) / (n+ + 2) and 1 /
/// (n- + 2). If decision values contradict the signs, the best sigmoid that does not fall is a
/// constant. `f` finite; `sign` > 0 is class a. Without `offset` p(0) is 1/2, so the class that f
/// favours is the likelier one.
Sigmoid fit_sigmoid(std::span<const double> f, std::span<const int> sign, bool offset = true);

/// `first_wins` per pair in the order of all_pairs(classes): probability of the first class, given
/// that it is one of the two. NaN is not allowed; values are clipped to [1e-7, 1 - 1e-7]. Returns p
/// >= 0 of sum 1 that minimises the sum over pairs of (r_ji p_i - r_ij p_j)^2. If the pairs are
/// consistent (r_ij = p_i / (p_i + p_j)), it is exactly that p. Needs 2 classes or more.
std::vector<double> couple(std::span<const double> first_wins, std::size_t classes);

/// Fitted to decisions on held-out training trials.
struct Calibration {
  std::vector<Sigmoid> sigmoid;  ///< per core; empty for a learner without cores
  /// The coupled probabilities are raised to this power and normalised again. Cores of two other
  /// fabrics make coupled probabilities more equal; one number corrects this on average.
  double sharpness = 1.0;
};

/// Probability of each of `classes` (ascending, one or more), given that the fabric is one of them.
/// `decision` is in the order of all_pairs(classes.size()). Not negative, sum 1, never NaN.
std::vector<double> probabilities(const Calibration& calibration, std::size_t all_classes,
                                  std::span<const std::size_t> classes,
                                  std::span<const double> decision);

/// Probabilities of a ballot, per class of the model; classes outside the vote have 0. Empty if the
/// ballot has no decisions to couple (VoteKind::dag, a short-list of one).
std::vector<double> probabilities(const Calibration& calibration, const Ballot& ballot);

/// One sigmoid per core, fitted to its held-out rows. If there is only one core, its probability
/// must agree with its own decision, so its sigmoid has no offset.
std::vector<Sigmoid> fit_sigmoids(const FabricModel& model, const CrossDecisions& held_out,
                                  std::size_t threads = 0);

/// Raises probabilities of sum 1 to a power and normalises them again.
void sharpen(std::vector<double>& p, double power);

/// The power, between 1/8 and 8, with the largest likelihood of the true classes; `probability` per
/// trial, at least one.
double fit_sharpness(const std::vector<std::vector<double>>& probability,
                     const std::vector<std::size_t>& truth);
/// The least power, from 1/8 on, with a likelihood within the 95 % bound of the largest (half of
/// chi-squared, 1.92). A few trials, all of them right, do not justify a larger power.
double cautious_sharpness(const std::vector<std::vector<double>>& probability,
                          const std::vector<std::size_t>& truth);

}  // namespace weft::classifier
