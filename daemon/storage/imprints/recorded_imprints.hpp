#pragma once
// Imprints in what a run has recorded: trials whose frames are scans of a dense array
// (docs/dataset.md, "Imprints"). The imprint of a trial is the last scan of phase P, when the force
// has been held the longest.

#include <optional>
#include <vector>

#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/taxel_grid.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// A device tells of rows and columns whose product is the number of taxels: those, with the pitch
/// and the bits where it tells of them; nothing of an empty set.
std::optional<classifier::imprint::TaxelGrid> grid_of_scans(const Dataset& dataset);
/// Whether there is one.
bool holds_scans(const Dataset& dataset);

/// One of each complete trial, in order: its object is the trial's label (the fabric), its label
/// the class that the recipe on record gives the object, or the object where the recipe has no
/// classes. Errors: invalid_argument, for a trial without a scan in phase P; corrupt, for a recipe
/// on record that cannot be read.
Result<std::vector<classifier::imprint::Imprint>> imprints_of_scans(const Dataset& dataset);

}  // namespace weft::daemon
