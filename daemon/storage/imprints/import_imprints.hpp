#pragma once
// Other people's imprints as a data set.

#include <filesystem>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// A manifest `file,label[,group]` as import_manifest() takes it; each file is one imprint that
/// read_image() reads, all with the same number of columns. A group is the object that was pressed,
/// or the number of the press.
Result<Dataset> import_imprints(const std::filesystem::path& manifest);

/// One file, one imprint a line: label, group, then rows x cols values, row by row. Lines that
/// begin with # are skipped, and so is a first line that has a word where a value should be. Errors
/// carry file:line.
Result<Dataset> import_imprint_table(const std::filesystem::path& table, std::size_t rows,
                                     std::size_t cols);

}  // namespace weft::daemon
