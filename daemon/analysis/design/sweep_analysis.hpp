#pragma once
// A swept campaign looked at cell by cell: how the array answers, how well the fabrics are told
// apart, how long it takes, and which cell to take. docs/design.md says how each is defined.

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

// The trials of swept data sets, cell by cell; what may be taken together and compared.

/// The complete trials of one cell, with what only their records tell.
struct CellTrials {
  std::vector<double> factors;  ///< SI, in the order of DatasetInfo::factors
  std::vector<classifier::Trial> trials;
  std::vector<double> seconds;  ///< of each, first to last sample
  double speed_mps = 0;         ///< of phase M; 0 without one
};

/// The recipe's explorations, each with its cells by rising factors: every cell that a recipe on
/// record plans, with trials or without. Groups and file names begin with the number of the data
/// set, so that the same repetition of two campaigns is not the same replicate.
using SweptCells = std::map<std::string, std::vector<CellTrials>>;

/// Refuses data sets that are no sweeps or the same one twice, and several that differ in kind of
/// bench, rig, sensors, sample rate or factors, or whose kind is not known: simulated and real data
/// are never mixed.
Result<SweptCells> swept_cells(std::span<const Dataset> datasets);

/// Why a cell cannot be compared with the others, by index into `cells`: those that can hold the
/// same fabrics, each in as many trials and the cell in as many replicates, as most cells do (of
/// equals: as those with more trials).
std::map<std::size_t, std::string> not_alike(std::span<const CellTrials* const> cells);

/// A mean or median over the trials of a cell with its 95 % interval.
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

/// A cell that could not be measured or compared.
struct LeftOutCell {
  std::vector<double> factors;
  std::string why;
};

/// How often the rule took a cell with this value of a factor.
struct FactorShare {
  std::size_t factor = 0;
  double value = 0;
  double share = 0;
};

struct SweepAnalysis {
  BenchKind bench = BenchKind::unknown;
  std::string exploration;            ///< as the recipe names it
  std::vector<std::string> datasets;  ///< digests
  std::vector<std::string> factors;   ///< "force_n"
  std::vector<std::string> fabrics;
  std::size_t replicates = 0;  ///< of each cell
  std::string learner;
  classifier::design::TextureBand band;
  std::vector<SweepCell> cells;           ///< by rising factors; at least one
  classifier::design::CellChoice choice;  ///< cells in the same order
  std::vector<LeftOutCell> left_out;      ///< by rising factors
  std::vector<std::string> without;       ///< other explorations, none of whose cells is left
  /// For every factor its surest value: what more of the resamples agree on than on a cell.
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

/// One analysis for each exploration of the recipe. Several data sets are taken together when
/// swept_cells() lets them. A cell that cannot be measured (fewer than three replicates, a slide of
/// too few samples, what the learner refuses) or holds other trials than most is left out by name;
/// refused is only what leaves no cell at all.
Result<std::vector<SweepAnalysis>> analyse_sweep(std::span<const Dataset> datasets,
                                                 const SweepOptions& options);

/// "5 N, 2 mm/s".
std::string format_cell(const SweepAnalysis& analysis, std::size_t cell);
std::string format_cell(const SweepAnalysis& analysis, const std::vector<double>& factors);
/// A factor for people: "force [N]", and a value of it in that unit.
std::string factor_title(std::string_view factor);
double factor_shown(std::string_view factor, double si);

/// The recommendation and its reason, or why there is none, in sentences.
std::string recommendation(const SweepAnalysis& analysis);
/// A line for each cell and exploration that is left out, and why; nothing where none is.
std::string format_left_out(const SweepAnalysis& analysis);

}  // namespace weft::daemon
