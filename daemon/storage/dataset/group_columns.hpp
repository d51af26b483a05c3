#pragma once
// Columns by which the rows of a data set can be grouped: further columns of a manifest (session,
// operator, ...), and what the place of a trial tells.

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

/// A column and its value of each row, in the order of the data set.
struct GroupColumn {
  std::string name;
  std::vector<std::string> of_row;
  bool operator==(const GroupColumn&) const = default;
};

/// What a manifest calls the column of groups itself.
inline constexpr std::string_view recorded_column = "recorded";

/// The named columns, then repetition, mounting, piece and patch where every trial tells of them.
std::vector<GroupColumn> list_group_columns(const Dataset& dataset);

/// `recorded` (the groups as they are) or one of list_group_columns(), a value for each trial.
/// Errors: not_found, for another name; unsupported, where a trial has no value, or all have one.
Result<std::vector<std::string>> group_labels(const Dataset& dataset, std::string_view column);

/// The same of `recorded` groups and any columns; `rows`: the names of the rows.
Result<std::vector<std::string>> find_group_labels(std::span<const GroupColumn> columns,
                                                   std::string_view column,
                                                   std::vector<std::string> recorded,
                                                   std::span<const std::string> rows);

/// Number of different values of each column.
std::map<std::string, std::size_t> count_values(std::span<const GroupColumn> columns);
/// "session: 4 values, operator: 2 values"; empty of none.
std::string format_columns(std::span<const GroupColumn> columns);

// Storage: `names` in byte order, each once, and in each row a value a name.

/// Errors: invalid_argument, for names out of order and texts that a column cannot hold.
Status check_group_names(std::span<const std::string> names);
/// Errors: invalid_argument, for another number of values.
Status check_group_values(std::span<const std::string> values, std::size_t names);

/// /group_columns; nothing where there are no names. `values`: row by row.
void write_group_columns(hdf5::Writer& out, const std::vector<std::string>& names,
                         const std::vector<std::string>& values);
struct StoredGroupColumns {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> of_row;  ///< in the order of the names
};
/// Of `rows` rows; without names where the file has none.
StoredGroupColumns read_group_columns(hdf5::Reader& in, std::size_t rows);

/// Names and values the other way round; `values(r)`: those of row r.
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
