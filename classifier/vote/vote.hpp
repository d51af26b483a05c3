#pragma once
// Ways to ask the cores of a trained model: all of them, or only those that matter.

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
  /// Platt, Cristianini, Shawe-Taylor 2000: the first class left against the last one left, the
  /// loser leaves. n - 1 of n (n - 1) / 2 cores; one lost duel is final.
  dag,
  shortlist  ///< majority among the classes whose means are nearest
};

std::string_view to_string(VoteKind kind);
Result<VoteKind> vote_kind_from(std::string_view text);

struct VoteOptions {
  VoteKind kind = VoteKind::majority;
  std::size_t shortlist = 20;             ///< classes on the short-list, at least 1
  const ClassProfile* profile = nullptr;  ///< of the model's training rows; VoteKind::shortlist
};

/// The outcome of one trial. A class that was not asked about has no votes and no support.
struct Ballot {
  std::size_t winner = 0;       ///< index into FabricModel::labels()
  std::vector<int> votes;       ///< per class
  std::vector<double> support;  ///< per class: sum of tanh(f) of the cores asked, in favour
  std::size_t cores = 0;        ///< decision values that were computed
  /// Classes between which every core was asked, ascending, and its decision values in the order of
  /// all_pairs(classes.size()). Both empty for VoteKind::dag.
  std::vector<std::size_t> classes;
  std::vector<double> decision;
};

/// Place of the core of classes a < b among all_pairs(classes).
constexpr std::size_t pair_index(std::size_t a, std::size_t b, std::size_t classes) {
  return a * (2 * classes - a - 1) / 2 + b - a - 1;
}

/// Refuses: another number of features, values that are not finite, a short-list without profile or
/// with one of another model, a decision that is not finite.
Result<Ballot> vote(const FabricModel& model, std::span<const double> features,
                    const VoteOptions& options = {});

/// The outcome of `decision`, all cores' in the order of model.pairs(), by VoteKind::majority or
/// soft. Refuses a decision that is not finite.
Result<Ballot> count_all(const FabricModel& model, std::vector<double> decision, VoteKind kind);

/// How many rows' decisions are worth having in memory at a time: at most 4 million decisions, 32
/// MB.
std::size_t rows_at_a_time(const FabricModel& model);

/// Refuses another number of features than the model's, and values that are not finite, by name.
Status check_features(const FabricModel& model, std::span<const double> features);

}  // namespace weft::classifier
