#pragma once
// Imprints in a data set (docs/reference/dataset.md, "Imprints"): a trial of exploration `imprint`.
// Its samples are the rows of the array, top to bottom, and its taxels are the columns.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/imprint/imprint_set.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// Third-party imprints as a data set.

/// A manifest `file,label[,group]` as in import_manifest(). Each file is one imprint that
/// read_image() reads, all with the same number of columns. A group is the pressed object, or the
/// number of the press. `bench`: as in import_manifest().
Result<Dataset> import_imprints(const std::filesystem::path& manifest,
                                std::optional<BenchKind> bench = {});

/// One file with one imprint per line: label, group, then rows x cols values, row by row. A first
/// line that names a column `label` is a heading, and columns are then found by name. A line that
/// starts with # is an imprint if it has all fields; other such lines are skipped with a warning.
/// Errors carry file:line.
Result<Dataset> import_imprint_table(const std::filesystem::path& table, std::size_t rows,
                                     std::size_t cols, BenchKind bench = BenchKind::unknown);

// Imprints in a recorded campaign: trials in which a frame is one scan of a dense array
// (docs/reference/dataset.md, "Imprints"). The imprint of a trial is the last scan of phase P, when
// the force has been held the longest.

/// True if a device reports rows and columns with a product equal to the number of taxels; it may
/// also report pitch and bits. False for an empty set.
bool holds_scans(const Dataset& dataset);

inline constexpr std::string_view imprint_exploration = "imprint";

/// True if every trial is an imprint, or the trials are scans of an array. False for an empty set.
bool holds_imprints(const Dataset& dataset);

/// Adds one imprint. `image` must be checked. Errors: invalid_argument for a size that differs from
/// the earlier imprints, and those of append().
Status append_imprint(Dataset& dataset, const classifier::imprint::Image& image, std::string file,
                      std::string label, std::string group);

/// The complete imprints, in order. The object is the trial's group. If a group holds several
/// labels, objects are numbered within their class, and label and group together form the object.
/// Without a group, each imprint is an object of its own.
///
/// Scans give one imprint per trial: its object is the trial's label (the fabric). Its label is the
/// class of that object in the recorded recipe, or the object if the recipe has no classes. Errors:
/// invalid_argument for a data set with other trials, imprints of different sizes, or a trial
/// without a scan in phase P; corrupt for a recorded recipe that cannot be read.
Result<std::vector<classifier::imprint::Imprint>> extract_imprints(const Dataset& dataset);

/// The array of `imprints`, which come from `dataset`: rows and columns. Pitch and bits are known
/// for scans and the scene `imprint`; files of other programs contain neither. Refuses an empty
/// list and imprints of different sizes.
Result<classifier::imprint::TaxelGrid> find_grid(
    const Dataset& dataset, std::span<const classifier::imprint::Imprint> imprints);

}  // namespace weft::daemon
