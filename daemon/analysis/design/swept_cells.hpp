#pragma once
// The trials of swept data sets, cell by cell; what may be taken together and compared.

#include <map>
#include <span>
#include <string>
#include <vector>

#include "classifier/features/trial.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

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

}  // namespace weft::daemon
