#pragma once
// Kinds of vote of a trained model: with all cores, or only with those that matter.

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/vote/novelty.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

enum class VoteKind {
  majority,  ///< all cores; most votes, then the largest sum of tanh(f), then the first label
             ///< (AMB-17)
  soft,      ///< all cores; the largest sum of tanh(f), then most votes, then the first label
  /// Platt, Cristianini, Shawe-Taylor 2000: the first remaining class against the last one; the
  /// loser is removed. Uses n - 1 of n (n - 1) / 2 cores; one wrong decision is final.
  dag,
  shortlist  ///< majority among the classes with the nearest means
};

std::string_view to_string(VoteKind kind);
Result<VoteKind> vote_kind_from(std::string_view text);

struct VoteOptions {
  VoteKind kind = VoteKind::majority;
  std::size_t shortlist = 20;  ///< classes on the short-list, at least 1
  const ClassProfile* profile =
      nullptr;  ///< of the model's training rows; needed for VoteKind::shortlist
};

/// The vote on one trial. A class outside the vote has no votes and no support.
struct Ballot {
  std::size_t winner = 0;       ///< index into FabricModel::labels()
  std::vector<int> votes;       ///< per class
  std::vector<double> support;  ///< per class: sum of tanh(f) of the cores used, with the sign in
                                ///< favour of the class
  std::size_t cores = 0;        ///< number of decision values computed
  /// Classes with a decision for every pair, ascending, and the decision values in the order of
  /// all_pairs(classes.size()). Both are empty for VoteKind::dag.
  std::vector<std::size_t> classes;
  std::vector<double> decision;
};

/// Index of the core of classes a < b in all_pairs(classes).
constexpr std::size_t pair_index(std::size_t a, std::size_t b, std::size_t classes) {
  return a * (2 * classes - a - 1) / 2 + b - a - 1;
}

/// Refuses another number of features, non-finite values, a short-list without profile or with that
/// of another model, and a non-finite decision.
Result<Ballot> vote(const FabricModel& model, std::span<const double> features,
                    const VoteOptions& options = {});

/// Vote on `decision` (of all cores, in the order of model.pairs()) by VoteKind::majority or soft.
/// Refuses a non-finite decision.
Result<Ballot> count_all(const FabricModel& model, std::vector<double> decision, VoteKind kind);

/// Number of rows to decide in one block: at most 4 million decisions, 32 MB.
std::size_t rows_at_a_time(const FabricModel& model);

/// Refuses another number of features than the model's, and non-finite values, with their names.
Status check_features(const FabricModel& model, std::span<const double> features);

}  // namespace weft::classifier
