#pragma once
// The cells of a sweep weighed against each other: what separates the fabrics best for its seconds,
// and whether the data support a choice. docs/design.md, "Which cell".

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier::design {

// Which of several cells is taken: separability first, then time, then how well the taxels answer.
// docs/design.md, "Which cell".

/// What the rule knows of a cell.
struct CellStatistics {
  double accuracy = 0;       ///< share of the trials told right
  double seconds = 0;        ///< median per trial, less is better
  double seconds_error = 0;  ///< standard error of that median
  double snr_db = 0;         ///< mean, more is better
};

/// Times that differ by less than this share of the shorter one are equal: what is on record is
/// about half of what a trial takes, so a campaign would not notice.
inline constexpr double equal_seconds_share = 0.05;

/// Seconds within which two cells take equally long: `equal_seconds_share` of the shorter time, or
/// what the difference of their medians varies by (95 %), whichever is more.
double seconds_tolerance(const CellStatistics& a, const CellStatistics& b);
bool is_cheaper(const CellStatistics& a, const CellStatistics& b);

/// Of an accuracy among so many answers; 0 and 1 count as if half an answer more were the other
/// way.
double standard_error(double accuracy, double requested);

/// Of the cells whose accuracy is at most one standard error below the best (Breiman and others
/// 1984), those that take no longer than the quickest of them; of these the one with the largest
/// signal over noise. `requested`: effective answers of a cell. At least one cell.
std::size_t take(std::span<const CellStatistics> cells, double requested);

/// Cells that no other one beats, in the order of their time: another one beats a cell when it is
/// more accurate and takes no longer, or is as accurate and takes less.
std::vector<std::size_t> find_front(std::span<const CellStatistics> cells);

/// Whether each trial (row of the matrix) was told right by a learner that knew none of its
/// replicate. Leaves each group out in turn. Refuses fewer than two labels, fewer than three groups
/// (what is left would be one trial of each), a label that a single group has, and what the learner
/// refuses.
Result<std::vector<bool>> separability(const FeatureMatrix& matrix, Learner learner,
                                       std::uint64_t seed, const std::function<bool()>& stop = {});

struct CellTrial {
  std::size_t replicate = 0;  ///< 0, 1, ...: one training answers all trials of a replicate
  bool right = false;
  double seconds = 0;
  double snr_db = 0;
};

/// A cell as it is weighed.
struct WeighedCell {
  std::vector<std::vector<CellTrial>> fabrics;  ///< the trials of each
  [[nodiscard]] std::size_t requested() const;
};

struct CellSummary {
  CellStatistics figures;
  Interval ci95;            ///< of the accuracy, see clustered_interval()
  double chosen_share = 0;  ///< of the resamples in which the rule takes this cell
};

struct CellChoice {
  std::vector<CellSummary> cells;
  std::vector<std::size_t> front;  ///< see find_front()
  std::size_t chosen = 0;
  std::size_t most_separable = 0;
  std::size_t quickest = 0;     ///< of the cells within one standard error
  double within = 0;            ///< of the best accuracy: one standard error
  double design_effect = 1;     ///< see design_effect()
  std::size_t equal_time = 0;   ///< of those, how many take no longer than the quickest
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

/// The rule take() on what was measured, and on what other pilots of the same size might find:
/// trials drawn with replacement within each fabric and cell, and from those again, so that the
/// share of a choice is how often a pilot that is done again would choose the same; accuracies are
/// widened by the design effect. At least one cell, each with answers; cells of equal fabrics and
/// replicates.
CellChoice choose_cell(const std::vector<WeighedCell>& cells, std::size_t resamples,
                       std::uint64_t seed);

}  // namespace weft::classifier::design
