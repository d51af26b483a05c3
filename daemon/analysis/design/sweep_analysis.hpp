#pragma once
// Analysis of a swept campaign cell by cell: response of the array, accuracy, duration, and the
// recommended cell. Definitions: docs/explanation/campaign-design.md.

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "classifier/design/cells.hpp"
#include "classifier/design/response.hpp"
#include "classifier/features/trial.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// The trials of swept data sets by cell, and which of them can be combined and compared.

/// The complete trials of one cell, with data from their records.
struct CellTrials {
  std::vector<double> factors;  ///< SI, in the order of DatasetInfo::factors
  std::vector<classifier::Trial> trials;
  std::vector<double> seconds;  ///< duration of each, first to last sample
  double speed_mps = 0;         ///< in phase M; 0 without one
};

/// The recipe's explorations, each with its cells by rising factors. All cells planned by the
/// recorded recipe are included, with trials or without. Groups and file names start with the
/// number of the data set, so equal repetitions of two campaigns are different replicates.
using SweptCells = std::map<std::string, std::vector<CellTrials>>;

/// Refuses data sets without a sweep and duplicates. Refuses several that differ in kind of bench,
/// rig, sensors, sample rate or factors, or have an unknown kind: simulated and real data are never
/// mixed.
Result<SweptCells> swept_cells(std::span<const Dataset> datasets);

/// Reasons why cells cannot be compared with the others, by index into `cells`. Comparable cells
/// have the most frequent combination of fabrics, trials per fabric and replicates. On a tie, the
/// combination with more trials counts.
std::map<std::size_t, std::string> not_alike(std::span<const CellTrials* const> cells);

/// A mean or median over the trials of a cell, with its 95 % interval.
struct CellValue {
  double value = 0;
  classifier::Interval ci95;
};

struct SweepCell {
  std::vector<double> factors;  ///< SI, in the order of SweepAnalysis::factors
  std::size_t trials = 0;
  CellValue snr_db, saturated_share;  ///< means
  CellValue seconds;                  ///< median
};

/// A cell that could not be measured or compared, and the reason.
struct LeftOutCell {
  std::vector<double> factors;
  std::string why;
};

/// Share of the resamples in which the chosen cell has this value of a factor.
struct FactorShare {
  std::size_t factor = 0;
  double value = 0;
  double share = 0;
};

struct SweepAnalysis {
  BenchKind bench = BenchKind::unknown;
  std::string exploration;            ///< name in the recipe
  std::vector<std::string> datasets;  ///< digests
  std::vector<std::string> factors;   ///< "force_n"
  std::vector<std::string> fabrics;
  std::size_t replicates = 0;  ///< in each cell
  std::string learner;
  classifier::design::TextureBand band;
  std::vector<SweepCell> cells;           ///< by rising factors; not empty
  classifier::design::CellChoice choice;  ///< cells in the same order
  std::vector<LeftOutCell> left_out;      ///< by rising factors
  std::vector<std::string> without;       ///< other explorations without any remaining cell
  /// For each factor the value chosen in most resamples. More resamples agree on it than on one
  /// cell.
  std::vector<FactorShare> surest;
};

struct SweepOptions {
  classifier::Learner learner = classifier::Learner::lda;
  classifier::design::TextureBand band;
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
  std::size_t threads = 0;
  std::function<void(const std::string&)> progress = {};
};

/// One analysis for each exploration of the recipe. Several data sets are combined if swept_cells()
/// permits it. A cell is left out by name if it holds other trials than most, or cannot be
/// measured: fewer than three replicates, a slide with too few samples, an error of the learner.
/// Fails only if no cell is left.
Result<std::vector<SweepAnalysis>> analyse_sweep(std::span<const Dataset> datasets,
                                                 const SweepOptions& options);

/// "5 N, 2 mm/s".
std::string format_cell(const SweepAnalysis& analysis, std::size_t cell);
std::string format_cell(const SweepAnalysis& analysis, const std::vector<double>& factors);
/// A factor as displayed: "force [N]", and a value in that unit.
std::string factor_title(std::string_view factor);
double factor_shown(std::string_view factor, double si);

/// The recommendation and its reason, or why there is none, in sentences.
std::string recommendation(const SweepAnalysis& analysis);
/// One line with the reason for each cell and exploration left out; empty if none is.
std::string format_left_out(const SweepAnalysis& analysis);

}  // namespace weft::daemon
