#pragma once
// Imprints in a data set (docs/dataset.md, "Imprints"): a trial of exploration `imprint` whose
// samples are the rows of the array, top to bottom, and whose taxels are its columns.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/taxel_grid.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

inline constexpr std::string_view imprint_exploration = "imprint";

/// Every trial is an imprint, or scans of an array; false of an empty set.
bool holds_imprints(const Dataset& dataset);

/// Adds one. `image` must be checked. Errors: invalid_argument, for another size than the imprints
/// before it have, and those of append().
Status append_imprint(Dataset& dataset, const classifier::imprint::Image& image, std::string file,
                      std::string label, std::string group);

/// The complete imprints, in order; of scans see recorded_imprints.hpp. The object is the trial's
/// group; where a group holds several labels, objects are numbered within their class and one is
/// label and group together; without a group an imprint is an object of its own. Errors:
/// invalid_argument, for a data set that holds other trials, or imprints of different sizes.
Result<std::vector<classifier::imprint::Imprint>> extract_imprints(const Dataset& dataset);

/// The array of `imprints`, which are those of `dataset`: rows and columns, and of scans and of the
/// scene `imprint` pitch and bits; files of other programs tell of neither. Refuses no imprint and
/// imprints of different sizes.
Result<classifier::imprint::TaxelGrid> find_grid(
    const Dataset& dataset, std::span<const classifier::imprint::Imprint> imprints);

}  // namespace weft::daemon
