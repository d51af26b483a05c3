#pragma once
// How much of an accuracy does not come from the material. Learners predict the labels from tables
// that should not contain them ("probes"), on the splits of the full features. The accuracy is
// compared with that of permuted labels.

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
  std::size_t permutations = 199;  ///< with LDA
  std::size_t tree_permutations =
      99;               ///< with trees, which take longer; run only where they can change a verdict
  double level = 0.02;  ///< family-wise significance level, over all probes and both learners
  double least_share = 0.25;  ///< share of the full features' accuracy above chance
  std::uint64_t seed = 1;
  std::size_t threads = 0;  ///< 0: one per core; results do not depend on it
};

/// Units that a permutation moves as a whole, because the trials of a unit are not independent.
struct PermutationUnits {
  std::vector<std::size_t> of_row;               ///< unit of each row
  std::vector<std::string> label;                ///< of each unit
  std::vector<std::vector<std::size_t>> blocks;  ///< units that exchange labels among themselves
  bool of_groups = false;                        ///< a unit is a label's rows of one group

  /// Natural logarithm of the number of different assignments of the labels.
  [[nodiscard]] double log_arrangements() const;
};

/// If the splits keep groups whole, a unit holds the rows of one label in one group. Labels are
/// then exchanged within groups, or over all units if some group has only one unit. Otherwise a
/// unit is a recording. Errors: invalid_argument for a recording with two labels.
Result<PermutationUnits> make_permutation_units(const FeatureMatrix& matrix,
                                                std::span<const Split> splits);

/// Labels of the rows after one permutation.
std::vector<std::string> permute_labels(const PermutationUnits& units, RandomEngine& engine);

/// `parts` splits that keep units whole: groups where `by_group`, else recordings (every label as
/// evenly as possible). Each part tests once and all others train. Test rows of labels that do not
/// train are left out. Parts without test rows, or with one training label, are left out too, so
/// the result may be empty.
std::vector<Split> split_in_parts(const FeatureMatrix& matrix, bool by_group, std::size_t parts);

/// Result of the better one of LDA and trees.
struct Reached {
  Learner learner = Learner::lda;
  double accuracy = 0.0;  ///< mean over the splits
  Interval ci95;
};
/// Mean accuracy over the splits. Errors: those of evaluate().
Result<Reached> reach(const FeatureMatrix& matrix, std::span<const Split> splits,
                      const AuditOptions& options);

struct ProbeFigure {
  std::string name;
  std::size_t columns = 0;
  Reached reached;
  double chance = 0.0;  ///< mean over the permutations with LDA
  double share = 0.0;   ///< (accuracy - chance) / (full accuracy - chance); 0 if the full features
                        ///< are not above chance
  double p = 1.0;       ///< family-wise
  bool named = false;   ///< significant, and the share is at least the least share
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
  std::size_t tree_permutations = 0;  ///< 0: trees could not change a verdict
  AuditVerdict verdict = AuditVerdict::cannot_tell;
  CannotTell why = CannotTell::none;
};

/// Each learner gets half of the level. Its p of a probe is the share of permutations with a
/// largest accuracy, over all probes, that is no lower (Westfall and Young 1993, single step). The
/// observed labels count as one permutation. A probe's p is twice the smaller p of the two
/// learners. Trees are permuted as long as their p could change the verdict; otherwise a probe's p
/// is that of LDA. Errors: invalid_argument for a probe with other rows; those of evaluate().
Result<AuditFigures> audit(const FeatureMatrix& full, std::span<const Probe> probes,
                           std::span<const Split> splits, const AuditOptions& options = {});

}  // namespace weft::classifier
