#pragma once
// The cells of a sweep weighed against each other: what separates the fabrics best for its seconds,
// and whether the data support a choice. docs/design.md, "Which cell".

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "classifier/baseline/learner.hpp"
#include "classifier/evaluate/interval.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier::design {

/// Whether each trial was told right by a learner that knew none of its replicate.
struct CellAnswers {
  std::vector<std::vector<bool>> right;  ///< [fabrics] its trials
  [[nodiscard]] std::size_t asked() const;
  [[nodiscard]] double accuracy() const;
};

/// Leaves each group out in turn. Refuses fewer than two labels, fewer than three groups (what is
/// left would be one trial of each) and what the learner refuses.
Result<CellAnswers> separability(const FeatureMatrix& matrix, Learner learner, std::uint64_t seed,
                                 const std::function<bool()>& stop = {});

/// A cell as it is weighed.
struct WeighedCell {
  CellAnswers answers;
  double seconds = 0;  ///< per trial, less is better
  double snr_db = 0;   ///< decides between cells of equal time
};

struct CellSummary {
  double accuracy = 0;
  Interval ci95;            ///< Wilson's, of its answers
  double chosen_share = 0;  ///< of the resamples in which the rule takes this cell
};

struct CellChoice {
  std::vector<CellSummary> cells;
  std::size_t chosen = 0;
  std::size_t most_separable = 0;
  double within = 0;            ///< of the best accuracy: one standard error
  double share = 0;             ///< of the resamples in which the same cell is chosen
  std::size_t overlapping = 0;  ///< other cells whose interval overlaps that of the chosen one
  std::size_t quicker_overlapping = 0;  ///< of those, the cells that take less time
  /// There was a choice, the chosen cell tells fabrics apart better than chance, the choice came
  /// out in at least `stable_share` of the resamples, and no quicker cell's interval overlaps:
  /// nothing quicker may be as good.
  bool supported = false;
  std::size_t resamples = 0;
};
inline constexpr double stable_share = 0.8;

/// The rule: of all cells whose accuracy is at most one standard error below the best (Breiman and
/// others 1984), the one that takes the least time; of equals the one with the larger signal. It is
/// then applied to what other pilots of the same size might find: trials drawn with replacement
/// within each fabric and cell, and from those again, so that the share of a choice is how often a
/// pilot that is done again would choose the same. At least one cell, each with answers.
CellChoice choose_cell(const std::vector<WeighedCell>& cells, std::size_t resamples,
                       std::uint64_t seed);

}  // namespace weft::classifier::design
