#pragma once
// A probability per fabric from the decision values of the cores: decisions on training trials held
// out, the sigmoids fitted to them, and the coupling of pairs.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/vote/vote.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// What the cores say of training trials that they have not seen: calibration and reject rule are
// learnt from these, never from the fit of the training trials themselves.

/// Decisions on training rows, each by a core that was trained without the row.
struct CrossDecisions {
  std::vector<std::size_t> own;  ///< per row: its class
  /// [rows x classes]: f of the core of the row's own class against the column's, positive in
  /// favour of the own class; 0 in the own column.
  Matrix against;

  /// [rows asked about x cores]: all cores' decisions, in the order of model.pairs(), held out
  /// where a row's own class takes part; the other cores have never seen it. `values` of the
  /// training.
  [[nodiscard]] Matrix of_rows(const FabricModel& model, const Matrix& values,
                               std::span<const std::size_t> rows, std::size_t threads = 0) const;
};

/// Trains every core again on each of its folds with the parameters that it chose, and asks it for
/// the rows held out. `matrix` and `options` are those of the training: the folds come out the
/// same. A row that no fold holds out keeps 0. Features are chosen inside each fold. Refuses other
/// columns or labels than the model's.
Result<CrossDecisions> cross_decisions(const FabricModel& model, const FeatureMatrix& matrix,
                                       const TrainOptions& options);

// From a core's decision value to the probability of its first class (Platt 2000, with the
// numerics of Lin, Lin and Weng 2007).

/// p(f) = 1 / (1 + exp(slope f + offset)), slope <= 0: a larger f never makes class a less likely.
struct Sigmoid {
  double slope = 0.0;
  double offset = 0.0;

  /// In [0, 1]; never NaN, whatever finite f, slope and offset.
  [[nodiscard]] double operator()(double f) const;
};

/// Maximum likelihood on decision values that cross-validation held out, with Platt's targets
/// (n+ + 1) / (n+ + 2) and 1 / (n- + 2). Where decision values say the opposite of the signs, the
/// best sigmoid that does not fall is a constant. `f` finite; `sign` > 0 is class a. Without
/// `offset` p(0) is 1/2, so that the class that f is in favour of is the likelier one.
Sigmoid fit_sigmoid(std::span<const double> f, std::span<const int> sign, bool offset = true);

/// `first_wins` per pair in the order of all_pairs(classes): probability that it is the first of
/// the two, if it is one of the two; NaN is not allowed, values are clipped to [1e-7, 1 - 1e-7].
/// Returns p >= 0 of sum 1 that minimises sum over pairs of (r_ji p_i - r_ij p_j)^2: where the
/// pairs agree with each other (r_ij = p_i / (p_i + p_j)), exactly that p. Needs 2 classes or more.
std::vector<double> couple(std::span<const double> first_wins, std::size_t classes);

/// Learnt from decisions on training trials that the cores had not seen.
struct Calibration {
  std::vector<Sigmoid> sigmoid;  ///< per core; empty for a learner without cores
  /// The coupled probabilities are raised to this power and normalised again. Cores that know
  /// neither fabric pull coupled probabilities towards each other; one number undoes it on average.
  double sharpness = 1.0;
};

/// Probability of each of `classes` (ascending, two or more or one) given that it is one of them;
/// `decision` in the order of all_pairs(classes.size()). Not negative, sum 1, never NaN.
std::vector<double> probabilities(const Calibration& calibration, std::size_t all_classes,
                                  std::span<const std::size_t> classes,
                                  std::span<const double> decision);

/// The same of a ballot, per class of the model; classes that were not asked about have 0. Empty
/// where the ballot has no decisions to couple (VoteKind::dag, a short-list of one).
std::vector<double> probabilities(const Calibration& calibration, const Ballot& ballot);

/// One per core, from its held-out rows. A single core has none but its own decision to agree with:
/// its sigmoid has no offset.
std::vector<Sigmoid> fit_sigmoids(const FabricModel& model, const CrossDecisions& held_out,
                                  std::size_t threads = 0);

/// Probabilities of sum 1 to a power, normalised again.
void sharpen(std::vector<double>& p, double power);

/// The power, between 1/8 and 8, under which the true classes are most likely; `probability` per
/// trial, at least one.
double fit_sharpness(const std::vector<std::vector<double>>& probability,
                     const std::vector<std::size_t>& truth);
/// The least power, from 1/8 on, whose likelihood is within the 95 % bound of the largest (half of
/// chi-squared, 1.92): what few trials, all of them right, allow to say.
double cautious_sharpness(const std::vector<std::vector<double>>& probability,
                          const std::vector<std::size_t>& truth);

}  // namespace weft::classifier
