#pragma once
// Imprints in a data set (docs/dataset.md, "Imprints"): a trial of exploration `imprint` whose
// samples are the rows of the array, top to bottom, and whose taxels are its columns.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/imprint/imprint_set.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// Other people's imprints as a data set.

/// A manifest `file,label[,group]` as import_manifest() takes it; each file is one imprint that
/// read_image() reads, all with the same number of columns. A group is the object that was pressed,
/// or the number of the press. `bench` likewise.
Result<Dataset> import_imprints(const std::filesystem::path& manifest,
                                std::optional<BenchKind> bench = {});

/// One file, one imprint a line: label, group, then rows x cols values, row by row. A first line
/// that names a column `label` is a heading, and columns go by its names. A line that begins with #
/// is an imprint where it has all fields; others are left out with a warning. Errors carry
/// file:line.
Result<Dataset> import_imprint_table(const std::filesystem::path& table, std::size_t rows,
                                     std::size_t cols, BenchKind bench = BenchKind::unknown);

// Imprints in what a run has recorded: trials whose frames are scans of a dense array
// (docs/dataset.md, "Imprints"). The imprint of a trial is the last scan of phase P, when the force
// has been held the longest.

/// Whether a device tells of rows and columns whose product is the number of taxels, with the pitch
/// and the bits where it tells of them; false of an empty set.
bool holds_scans(const Dataset& dataset);

inline constexpr std::string_view imprint_exploration = "imprint";

/// Every trial is an imprint, or scans of an array; false of an empty set.
bool holds_imprints(const Dataset& dataset);

/// Adds one. `image` must be checked. Errors: invalid_argument, for another size than the imprints
/// before it have, and those of append().
Status append_imprint(Dataset& dataset, const classifier::imprint::Image& image, std::string file,
                      std::string label, std::string group);

/// The complete imprints, in order. The object is the trial's group; where a group holds several
/// labels, objects are numbered within their class and one is label and group together; without a
/// group an imprint is an object of its own. Of scans one of each trial: its object is the trial's
/// label (the fabric), its label the class that the recipe on record gives the object, or the
/// object where the recipe has no classes. Errors: invalid_argument, for a data set that holds
/// other trials, imprints of different sizes, or a trial without a scan in phase P; corrupt, for a
/// recipe on record that cannot be read.
Result<std::vector<classifier::imprint::Imprint>> extract_imprints(const Dataset& dataset);

/// The array of `imprints`, which are those of `dataset`: rows and columns, and of scans and of the
/// scene `imprint` pitch and bits; files of other programs tell of neither. Refuses no imprint and
/// imprints of different sizes.
Result<classifier::imprint::TaxelGrid> find_grid(
    const Dataset& dataset, std::span<const classifier::imprint::Imprint> imprints);

}  // namespace weft::daemon
