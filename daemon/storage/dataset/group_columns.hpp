#pragma once
// Columns by which the rows of a data set can be grouped: further columns of a manifest (session,
// operator, ...), the factors of a sweep, and the recorded place of a trial.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::hdf5 {
class Writer;
class Reader;
}  // namespace weft::daemon::hdf5

namespace weft::daemon {

/// A column with one value per row, in the order of the data set.
struct GroupColumn {
  std::string name;
  std::vector<std::string> of_row;
  bool operator==(const GroupColumn&) const = default;
};

/// Column name that selects the recorded groups themselves (the manifest's `group`).
inline constexpr std::string_view recorded_column = "recorded";

/// The named columns, the factors of a sweep (SI values), then repetition, mounting, piece and
/// patch if every trial has them.
std::vector<GroupColumn> list_group_columns(const Dataset& dataset);

/// Values of `recorded` (the recorded groups) or one of list_group_columns(), one per trial.
/// Errors: not_found for another name; unsupported if a trial has no value, or all trials have the
/// same one.
Result<std::vector<std::string>> group_labels(const Dataset& dataset, std::string_view column);

/// The same for given `recorded` groups and any columns; `rows`: the names of the rows.
Result<std::vector<std::string>> find_group_labels(std::span<const GroupColumn> columns,
                                                   std::string_view column,
                                                   std::vector<std::string> recorded,
                                                   std::span<const std::string> rows);

/// Number of different values of each column.
std::map<std::string, std::size_t> count_values(std::span<const GroupColumn> columns);
/// "session: 4 values, operator: 2 values"; empty without columns.
std::string format_columns(std::span<const GroupColumn> columns);

// Storage: `names` in byte order without duplicates, and one value per name in each row.

/// Errors: invalid_argument for unsorted names and for texts that a column cannot store.
Status check_group_names(std::span<const std::string> names);
/// Errors: invalid_argument for a wrong number of values.
Status check_group_values(std::span<const std::string> values, std::size_t names);

/// Writes /group_columns; nothing without names. `values`: row by row.
void write_group_columns(hdf5::Writer& out, const std::vector<std::string>& names,
                         const std::vector<std::string>& values);
struct StoredGroupColumns {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> of_row;  ///< in the order of the names
};
/// For a file of `rows` rows; without names if the file has no group columns.
StoredGroupColumns read_group_columns(hdf5::Reader& in, std::size_t rows);

/// Converts rows of values to columns; `values(r)`: the values of row r.
template <class Values>
std::vector<GroupColumn> transposed_columns(const std::vector<std::string>& names, std::size_t rows,
                                            Values values) {
  std::vector<GroupColumn> out;
  for (std::size_t c = 0; c < names.size(); ++c) {
    out.push_back({names[c], {}});
    for (std::size_t r = 0; r < rows; ++r) out.back().of_row.push_back(values(r)[c]);
  }
  return out;
}

}  // namespace weft::daemon
