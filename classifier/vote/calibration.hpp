#pragma once
// A probability per fabric from the decision values of the cores.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/vote/cross_decisions.hpp"
#include "classifier/vote/sigmoid.hpp"
#include "classifier/vote/vote.hpp"

namespace weft::classifier {

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

/// One per core, from its held-out rows.
std::vector<Sigmoid> fit_sigmoids(const FabricModel& model, const CrossDecisions& held_out,
                                  std::size_t threads = 0);

/// Probabilities of sum 1 to a power, normalised again.
void sharpen(std::vector<double>& p, double power);

/// The power, between 1/8 and 8, under which the true classes are most likely; `probability` per
/// trial, at least one.
double fit_sharpness(const std::vector<std::vector<double>>& probability,
                     const std::vector<std::size_t>& truth);

}  // namespace weft::classifier
