#pragma once
// Weighs the cells of a sweep: which cell separates the fabrics best for its seconds, and whether
// the data support a choice. docs/explanation/campaign-design.md, "Which cell".

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier::design {

// The rule that chooses a cell: separability first, then time, then the response of the taxels.
// docs/explanation/campaign-design.md, "Which cell".

/// Inputs of the rule for one cell.
struct CellStatistics {
  double accuracy = 0;       ///< accuracy of the trials, 0 to 1
  double seconds = 0;        ///< median per trial [s]; less is better
  double seconds_error = 0;  ///< standard error of that median [s]
  double snr_db = 0;         ///< mean [dB]; more is better
};

/// Times that differ by less than this share of the shorter one count as equal. The recorded time
/// is about half of a trial's time, so a campaign would not notice the difference.
inline constexpr double equal_seconds_share = 0.05;

/// Largest difference of time at which two cells take equally long [s]. It is the larger of
/// `equal_seconds_share` of the shorter time and the 95 % variation of the difference of their
/// medians.
double seconds_tolerance(const CellStatistics& a, const CellStatistics& b);
bool is_cheaper(const CellStatistics& a, const CellStatistics& b);

/// Standard error of an accuracy among `requested` answers. An accuracy of 0 or 1 counts as if half
/// an answer were the other way.
double standard_error(double accuracy, double requested);

/// Applies the rule to at least one cell. Candidates: cells with an accuracy at most one standard
/// error below the best (Breiman and others 1984). The rule keeps the candidates that take no
/// longer than the quickest one. It takes the one with the largest signal over noise. `requested`:
/// effective number of answers of a cell.
std::size_t take(std::span<const CellStatistics> cells, double requested);

/// Cells that no other cell beats, in the order of their time. A cell beats another if it is more
/// accurate and takes no longer, or is as accurate and takes less.
std::vector<std::size_t> find_front(std::span<const CellStatistics> cells);

/// Whether the prediction of each trial (row of the matrix) is right. The learner has not seen any
/// trial of the same replicate: each group is left out once. Refuses fewer than two labels, fewer
/// than three groups (the rest would be one trial of each), a label of a single group, and the
/// errors of the learner.
Result<std::vector<bool>> separability(const FeatureMatrix& matrix, Learner learner,
                                       std::uint64_t seed, const std::function<bool()>& stop = {});

struct CellTrial {
  std::size_t replicate = 0;  ///< 0, 1, ...; one training predicts all trials of a replicate
  bool right = false;
  double seconds = 0;
  double snr_db = 0;
};

/// A cell with its trials, input of choose_cell().
struct WeighedCell {
  std::vector<std::vector<CellTrial>> fabrics;  ///< the trials of each fabric
  [[nodiscard]] std::size_t requested() const;
};

struct CellSummary {
  CellStatistics figures;
  Interval ci95;            ///< of the accuracy, see clustered_interval()
  double chosen_share = 0;  ///< share of the resamples in which the rule chooses this cell
};

struct CellChoice {
  std::vector<CellSummary> cells;
  std::vector<std::size_t> front;  ///< see find_front()
  std::size_t chosen = 0;
  std::size_t most_separable = 0;
  std::size_t quickest = 0;  ///< quickest cell within one standard error of the best accuracy
  double within = 0;         ///< one standard error of the best accuracy
  double design_effect = 1;  ///< see design_effect()
  std::size_t equal_time =
      0;  ///< number of cells within one standard error that take no longer than the quickest
  double share = 0;  ///< share of the resamples in which the same cell is chosen
  std::size_t overlapping =
      0;  ///< other cells with an interval that overlaps that of the chosen one
  std::size_t quicker_overlapping = 0;  ///< those of the overlapping cells that take less time
  /// True if all of these hold: there is more than one cell; the chosen cell tells fabrics apart
  /// better than chance; at least `stable_share` of the resamples made the same choice; the
  /// interval of no quicker cell overlaps, so nothing quicker may be as good.
  bool supported = false;
  std::size_t resamples = 0;
};
inline constexpr double stable_share = 0.8;

/// Applies take() to the measured cells and to resampled pilot studies of the same size. Each
/// resample draws trials with replacement within each fabric and cell, and draws again from those.
/// The share of a choice is then how often a repeated pilot study would make it. The design effect
/// widens the accuracies. Needs at least one cell, each with answers; all cells need equal fabrics
/// and replicates.
CellChoice choose_cell(const std::vector<WeighedCell>& cells, std::size_t resamples,
                       std::uint64_t seed);

}  // namespace weft::classifier::design
