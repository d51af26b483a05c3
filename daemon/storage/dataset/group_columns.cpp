#include "daemon/storage/dataset/group_columns.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>

#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "protocols/base/closest.hpp"

namespace weft::daemon {
namespace {

constexpr const char* hdf5_group = "/group_columns";

bool can_be_stored(std::string_view text) {
  return text.size() <= hdf5::max_text_bytes && is_utf8(text) &&
         text.find('\0') == std::string_view::npos;
}

/// Nine digits: more than the six that tell two cells apart, and without the rounding of degrees in
/// radians.
std::string factor_value(double si) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), si,
                                          std::chars_format::general, 9);
  return {digits.data(), end};
}

/// Adds the factors of a sweep, in SI.
void add_factors(const Dataset& dataset, std::vector<GroupColumn>& out) {
  for (std::size_t f = 0; f < dataset.info.factors.size(); ++f) {
    GroupColumn column{dataset.info.factors[f], {}};
    for (const TrialRecord& record : dataset.records)
      column.of_row.push_back(factor_value(record.spec.factors[f]));
    out.push_back(std::move(column));
  }
}

/// Adds one number of each trial as a column; nothing if a trial lacks it.
template <class Number>
void add_numbers(const Dataset& dataset, const char* name, Number number,
                 std::vector<GroupColumn>& out) {
  GroupColumn column{name, {}};
  for (const TrialRecord& record : dataset.records) {
    if (number(record.spec) == 0) return;
    column.of_row.push_back(std::to_string(number(record.spec)));
  }
  out.push_back(std::move(column));
}

}  // namespace

std::vector<GroupColumn> list_group_columns(const Dataset& dataset) {
  auto out = transposed_columns(
      dataset.info.group_columns, dataset.records.size(), [&](std::size_t r) -> auto& {
        return dataset.records[r].spec.group_values;
      });
  add_factors(dataset, out);
  add_numbers(
      dataset, "repetition", [](const TrialSpec& s) { return s.repetition; }, out);
  add_numbers(
      dataset, "mounting", [](const TrialSpec& s) { return s.place.mounting; }, out);
  add_numbers(
      dataset, "piece", [](const TrialSpec& s) { return s.place.piece; }, out);
  add_numbers(
      dataset, "patch", [](const TrialSpec& s) { return s.place.patch; }, out);
  return out;
}

Result<std::vector<std::string>> group_labels(const Dataset& dataset, std::string_view column) {
  return find_group_labels(list_group_columns(dataset), column,
                           hdf5::gather(dataset.trials, &classifier::Trial::group),
                           hdf5::gather(dataset.trials, &classifier::Trial::file));
}

Result<std::vector<std::string>> find_group_labels(std::span<const GroupColumn> columns,
                                                   std::string_view column,
                                                   std::vector<std::string> recorded,
                                                   std::span<const std::string> rows) {
  if (column == recorded_column) return recorded;
  const auto found = std::ranges::find(columns, column, &GroupColumn::name);
  if (found == columns.end()) {
    std::vector<std::string_view> known{recorded_column};
    for (const GroupColumn& one : columns) known.push_back(one.name);
    return fail({.code = Errc::not_found,
                 .what = "unknown group column",
                 .expected = joined(known),
                 .got = shortened(column),
                 .hint = did_you_mean(column, known, "Add this column to the manifest")});
  }
  const auto missing = std::ranges::find(found->of_row, std::string());
  if (missing != found->of_row.end())
    return fail({.code = Errc::unsupported,
                 .where = rows[static_cast<std::size_t>(missing - found->of_row.begin())],
                 .what = "value missing in group column " + found->name,
                 .expected = "a value in every row"});
  if (std::ranges::all_of(found->of_row, [&](const auto& v) { return v == found->of_row[0]; }))
    return fail({.code = Errc::unsupported,
                 .what = "too few values in group column " + found->name,
                 .expected = "at least 2",
                 .got = "1",
                 .hint = "Add recordings with another value"});
  return found->of_row;
}

std::map<std::string, std::size_t> count_values(std::span<const GroupColumn> columns) {
  std::map<std::string, std::size_t> out;
  for (const GroupColumn& one : columns)
    out[one.name] = std::set<std::string_view>(one.of_row.begin(), one.of_row.end()).size();
  return out;
}

std::string format_columns(std::span<const GroupColumn> columns) {
  std::vector<std::string> out;
  for (const auto& [name, values] : count_values(columns))
    out.push_back(name + ": " + std::to_string(values) + (values == 1 ? " value" : " values"));
  return joined(out);
}

Status check_group_names(std::span<const std::string> names) {
  for (std::size_t c = 0; c < names.size(); ++c)
    if (names[c].empty() || !can_be_stored(names[c]) || (c > 0 && names[c] <= names[c - 1]))
      return fail({.where = shortened(names[c]),
                   .what = "name of a group column empty, not text, repeated or out of order"});
  return {};
}

Status check_group_values(std::span<const std::string> values, std::size_t names) {
  if (values.size() != names)
    return fail({.what = "wrong number of group columns",
                 .expected = std::to_string(names),
                 .got = std::to_string(values.size())});
  for (const std::string& value : values)
    if (!can_be_stored(value))
      return fail({.what = "value of a group column too long or not UTF-8 text",
                   .expected = "at most " + std::to_string(hdf5::max_text_bytes) + " bytes",
                   .got = shortened(value)});
  return {};
}

void write_group_columns(hdf5::Writer& out, const std::vector<std::string>& names,
                         const std::vector<std::string>& values) {
  if (names.empty()) return;
  const std::string group = hdf5_group;
  out.group(group);
  out.column(group + "/name", names);
  out.column(group + "/values", values);
  out.attribute(group + "/values", "meaning", "row by row, a value for each name");
}

StoredGroupColumns read_group_columns(hdf5::Reader& in, std::size_t rows) {
  const std::string group = hdf5_group;
  if (!in.has(group)) return {};
  StoredGroupColumns out{in.texts(group + "/name"), {}};
  const auto values = in.texts(group + "/values");
  const std::size_t names = out.names.size();
  if (!in.require(names > 0 && values.size() % names == 0 && values.size() / names == rows, group,
                  "number of values differs from the number of rows"))
    return {};
  for (auto at = values.begin(); at != values.end(); at += static_cast<std::ptrdiff_t>(names))
    out.of_row.emplace_back(at, at + static_cast<std::ptrdiff_t>(names));
  return out;
}

}  // namespace weft::daemon
