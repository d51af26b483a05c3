// Finds the columns of a table by their names.

#include <charconv>

#include "daemon/base/text/csv_table.hpp"
#include "protocols/base/closest.hpp"

namespace weft::daemon {
namespace {

/// `ch12` with prefix `ch` gives 12; nothing for anything else, including `ch012`.
std::optional<std::size_t> series_number(std::string_view name, std::string_view prefix) {
  if (!name.starts_with(prefix)) return std::nullopt;
  name.remove_prefix(prefix.size());
  std::size_t number = 0;
  const char* end = name.data() + name.size();
  const auto [stopped, error] = std::from_chars(name.data(), end, number);
  if (error != std::errc() || stopped != end || number == 0 || name.front() == '0')
    return std::nullopt;
  return number;
}

bool begins_number(std::string_view name) {
  return name.find_first_of("0123456789") == name.find_first_not_of("+-.");
}

}  // namespace

std::optional<std::size_t> CsvTable::find_column(std::string_view name) {
  const auto at = std::ranges::find(header_, name);
  if (at == header_.end()) return std::nullopt;
  const auto column = static_cast<std::size_t>(at - header_.begin());
  taken_[column] = true;
  return column;
}

Result<std::size_t> CsvTable::take_column(std::string_view name) {
  if (const auto column = find_column(name)) return *column;
  constexpr std::size_t most_listed = 8;
  std::vector<std::string> there;
  for (const std::string& own : header_)
    if (there.size() < most_listed) there.push_back("'" + shortened(own) + "'");
  const std::size_t more = header_.size() - there.size();
  return complaint("column " + std::string(name) + " missing", {},
                   joined(there) + (more > 0 ? " and " + std::to_string(more) + " more" : ""),
                   missing_hint(name));
}

std::string CsvTable::missing_hint(std::string_view name) const {
  if (const std::size_t line = find_line(name))
    return "Remove the lines before line " + std::to_string(line) + ", which has the column names";
  if (has_hash_) return hash_hint;
  if (header_.size() == 1 && header_.front().find(std::string(name) + " ") != std::string::npos)
    return "Export the table again with commas between names and between fields";
  if (std::ranges::all_of(header_, begins_number))
    return "Add a line with the column names before line 1, which has only numbers";
  std::vector<std::string_view> free;
  for (std::size_t i = 0; i < header_.size(); ++i)
    if (!taken_[i] && !begins_number(header_[i])) free.push_back(header_[i]);
  std::string_view meant = closest(name, free);
  // Other programs write time, timestamp.
  const std::string_view usual = name == "t_s" ? "time" : name;
  for (const std::string_view own : free)
    if (const std::string plain = lower_case(own);
        meant.empty() && (plain.starts_with(usual) || plain.starts_with(name)))
      meant = own;
  if (meant.empty()) return "Write the column names in the first line, exactly as given here";
  return "Did you mean '" + shortened(meant) + "'? Rename it to " + std::string(name) +
         (name == "t_s" ? ", in seconds" : "");
}

/// Number of a later line with this name as a field, which indicates a preamble; 0 if there is
/// none.
std::size_t CsvTable::find_line(std::string_view name) const {
  constexpr std::size_t most_lines = 200;
  constexpr std::string_view around = ",\"\r \t";
  std::size_t at = at_;
  for (std::size_t line = line_number_ + 1; at < text_.size() && line < most_lines; ++line) {
    const std::size_t end = std::min(text_.find(line_end_, at), text_.size());
    const std::string own = "," + text_.substr(at, end - at) + ",";
    for (std::size_t i = own.find(name); i != own.npos; i = own.find(name, i + 1))
      if (around.find(own[i - 1]) != around.npos &&
          around.find(own[i + name.size()]) != around.npos)
        return line;
    at = end + 1;
  }
  return 0;
}

Result<std::vector<std::size_t>> CsvTable::take_series(std::string_view prefix) {
  std::size_t highest = 1;
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (taken_[i]) continue;
    const auto number = series_number(header_[i], prefix);
    const std::string one = std::string(prefix) + "1";
    if (!number)
      return complaint("unknown column '" + shortened(header_[i]) + "'",
                       one + " to " + std::string(prefix) + "N", {},
                       series_number(lower_case(header_[i]), prefix)
                           ? "Did you mean '" + lower_case(header_[i]) + "'?"
                           : "");
    highest = std::max(highest, *number);
  }
  std::vector<std::size_t> out;
  for (std::size_t k = 1; k <= highest; ++k) {
    const auto column = take_column(std::string(prefix) + std::to_string(k));
    if (!column) return pass(column.error());
    out.push_back(*column);
  }
  return out;
}

std::vector<std::size_t> CsvTable::take_rest() {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < taken_.size(); ++i)
    if (!taken_[i]) out.push_back(i);
  taken_.assign(taken_.size(), true);
  return out;
}

Status CsvTable::check_rest(const std::vector<std::string_view>& known) const {
  const auto unknown = std::ranges::find(taken_, false);
  if (unknown == taken_.end()) return {};
  const std::string& name = header_[static_cast<std::size_t>(unknown - taken_.begin())];
  return complaint("unknown column '" + shortened(name) + "'", joined(known), {},
                   did_you_mean(name, known));
}

}  // namespace weft::daemon
