#pragma once
// How much of an accuracy is not the material: labels predicted from tables that must not tell them
// ("probes"), on the splits of the full features, against the same with permuted labels.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/base/random.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// A table with the rows, labels and groups of the full features.
struct Probe {
  std::string name;
  FeatureMatrix features;
};

struct AuditOptions {
  std::size_t permutations = 199;      ///< with LDA
  std::size_t tree_permutations = 99;  ///< with trees, which take longer; only where they decide
  double level = 0.02;                 ///< family-wise, over all probes and both learners
  double least_share = 0.25;           ///< of what the full features have above chance
  std::uint64_t seed = 1;
  std::size_t threads = 0;  ///< 0: one per core; results do not depend on it
};

/// What permutations move as a whole, because trials of it are not independent of each other.
struct PermutationUnits {
  std::vector<std::size_t> of_row;               ///< unit of each row
  std::vector<std::string> label;                ///< of each unit
  std::vector<std::vector<std::size_t>> blocks;  ///< units that exchange labels among themselves
  bool of_groups = false;                        ///< a unit is a label's rows of one group

  /// Natural logarithm of the number of different ways to give out the labels.
  [[nodiscard]] double log_arrangements() const;
};

/// Where the splits keep groups whole, a unit is a label's rows of one group, and labels are
/// exchanged within groups (over all units where a group has one label only). Else it is a
/// recording. Refuses a recording with two labels.
Result<PermutationUnits> make_permutation_units(const FeatureMatrix& matrix,
                                                std::span<const Split> splits);

/// Labels of the rows after one permutation.
std::vector<std::string> permute_labels(const PermutationUnits& units, RandomEngine& engine);

/// `parts` splits that keep units whole: groups where `by_group`, else recordings (of every label
/// as evenly as possible). Each part tests once, all others train; test rows of labels that do not
/// train are left out. Parts without test rows are left out too: there may be none.
std::vector<Split> split_in_parts(const FeatureMatrix& matrix, bool by_group, std::size_t parts);

/// What the better of LDA and trees reaches.
struct Reached {
  Learner learner = Learner::lda;
  double accuracy = 0.0;  ///< mean over the splits
  Interval ci95;
};
/// Errors: those of evaluate().
Result<Reached> reach(const FeatureMatrix& matrix, std::span<const Split> splits,
                      const AuditOptions& options);

struct ProbeFigure {
  std::string name;
  std::size_t columns = 0;
  Reached reached;
  double chance = 0.0;  ///< mean over the permutations with LDA
  double share = 0.0;  ///< (accuracy - chance) / (full accuracy - chance); 0 where full has nothing
  double p = 1.0;      ///< family-wise
  bool named = false;  ///< significant, and of at least the least share
};

enum class AuditVerdict { confounded, no_sign, cannot_tell };
enum class CannotTell { none, too_few_units, full_at_chance, no_probe };

struct AuditFigures {
  Reached full;
  double chance = 0.0;  ///< mean over the probes; 0 without one
  std::vector<ProbeFigure> probes;
  std::size_t units = 0;
  bool units_of_groups = false;
  std::size_t permutations = 0;
  std::size_t tree_permutations = 0;  ///< 0: they could not change a verdict
  AuditVerdict verdict = AuditVerdict::cannot_tell;
  CannotTell why = CannotTell::none;
};

/// Each learner has half of the level. Its p of a probe is the share of permutations in which the
/// largest accuracy of all probes is no lower (Westfall and Young 1993, single step), the observed
/// one counted; a probe's p is twice the smaller one. Trees are permuted as long as their p could
/// still decide; where they were not, a probe's p is that of LDA. Errors: invalid_argument for a
/// probe with other rows; those of evaluate().
Result<AuditFigures> audit(const FeatureMatrix& full, std::span<const Probe> probes,
                           std::span<const Split> splits, const AuditOptions& options = {});

}  // namespace weft::classifier
