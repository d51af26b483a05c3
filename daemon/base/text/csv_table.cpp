#include "daemon/base/text/csv_table.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "daemon/base/file/file_kind.hpp"
#include "daemon/base/file/read_file.hpp"

namespace weft::daemon {
namespace {

constexpr const char* marks_hint =
    "Export the table again with commas between fields and points as decimal marks";

/// Removes one field and the separator behind it from the front of `rest`; `more`: there was a
/// separator. False if a quote is not closed, or if text follows a closing quote.
bool take_field(std::string_view& rest, char separator, std::string& field, bool& more) {
  const std::string_view blanks = separator == '\t' ? " " : " \t";
  const std::size_t first = std::min(rest.find_first_not_of(blanks), rest.size());
  std::size_t end = 0;
  bool is_fine = true;
  if (rest.substr(first).starts_with('"')) {
    field.clear();
    std::size_t i = first + 1;
    for (; i < rest.size() && (rest[i] != '"' || rest.substr(i + 1).starts_with('"')); ++i)
      field += rest[i] == '"' ? rest[i++] : rest[i];
    end = std::min(rest.find(separator, i), rest.size());
    is_fine = i < rest.size() && trimmed(rest.substr(i + 1, end - i - 1), blanks).empty();
  } else {
    end = std::min(rest.find(separator), rest.size());
    field.assign(trimmed(rest.substr(0, end), blanks));
  }
  more = end < rest.size();
  rest = more ? rest.substr(end + 1) : std::string_view{};
  return is_fine;
}

/// The line with one tab in place of each run of blanks. A run with several tabs keeps that number
/// of tabs: each further one adds an empty field. Text in quotes is not changed.
std::string with_tabs(std::string_view line) {
  std::string out;
  line = trimmed(line, " ");
  for (std::size_t i = 0; i < line.size();) {
    const std::size_t behind =
        line[i] == '"' ? line.find('"', i + 1) : line.find_first_of(" \t", i);
    const std::size_t end =
        std::min(line[i] == '"' && behind != line.npos ? behind + 1 : behind, line.size());
    out += line.substr(i, end - i);
    i = std::min(line.find_first_not_of(" \t", end), line.size());
    const auto tabs = std::ranges::count(line.substr(end, i - end), '\t');
    if (i > end) out.append(static_cast<std::size_t>(std::max<std::ptrdiff_t>(tabs, 1)), '\t');
  }
  return out;
}

/// Number of characters from the decimal point on; 0 without a point.
std::size_t decimals_of(std::string_view field) {
  const std::size_t point = field.find('.');
  return point == std::string_view::npos ? 0 : field.size() - point;
}

/// `text` as a number; an error unless the whole text is one.
std::from_chars_result parse_number(std::string_view text, double& value) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  auto out = std::from_chars(text.data(), text.data() + text.size(), value);
  if (out.ptr != text.data() + text.size()) out.ec = std::errc::invalid_argument;
  return out;
}

std::string lines_text(const std::vector<std::size_t>& lines) {
  return lines.size() == 1
             ? "line " + std::to_string(lines.front())
             : std::to_string(lines.size()) + " lines, first line " + std::to_string(lines.front());
}

}  // namespace

Result<CsvTable> CsvTable::open(const std::filesystem::path& path, CsvRules rules) {
  std::error_code unseen;
  if (!std::filesystem::is_regular_file(path, unseen))
    return fail({.code = Errc::not_found, .where = path, .what = "no such file"});
  auto text = read_file(path, max_file_bytes);
  if (!text) return pass(std::move(text).error());
  return from_text(path.string(), std::move(*text), std::move(rules));
}

Result<CsvTable> CsvTable::from_text(std::string name, std::string text, CsvRules rules) {
  CsvTable out;
  out.rules_ = std::move(rules);
  out.width_ = out.rules_.width;
  out.name_ = std::move(name);
  out.text_ = std::move(text);
  if (const FileKind kind = file_kind(out.text_); !kind.name.empty())
    return fail({.code = Errc::parse,
                 .where = out.name_,
                 .what = "not a table",
                 .expected = "text with one line per row",
                 .got = std::string(kind.name),
                 .hint = std::string(kind.advice)});
  if (out.text_.starts_with("\xEF\xBB\xBF")) out.at_ = 3;
  if (out.text_.find('\n') == std::string::npos) out.line_end_ = '\r';
  if (auto done = out.read_heading(); !done) return pass(std::move(done).error());
  return out;
}

Status CsvTable::read_heading() {
  if (rules_.heading == CsvRules::Heading::never) return {};
  const auto more = next_line();
  if (!more) return pass(more.error());
  if (rules_.heading == CsvRules::Heading::if_label) {
    is_read_ = *more && !has_label();
    if (is_read_) return check_line();
  } else if (!*more) {
    return fail({.code = Errc::parse,
                 .where = name_,
                 .what = "file empty",
                 .expected = "a line with the column names"});
  }
  if (!*more) return {};
  header_ = fields_;
  if (rules_.heading == CsvRules::Heading::always) width_ = header_.size();
  taken_.assign(header_.size(), false);
  separator_ = line_separator_;
  if (rules_.heading == CsvRules::Heading::always) return check_heading();
  header_.front() = trimmed(header_.front(), "# \t");
  for (std::string& own : header_) own = lower_case(own);
  return {};
}

// Every table here has two or more columns, so commas between digits may be decimal marks. Such a
// file is refused rather than guessed.
Status CsvTable::check_heading() const {
  const std::string& first = header_.front();
  if (lower_case(first).starts_with("sep="))
    return complaint("spreadsheet line instead of the column names", {}, first,
                     "Remove the line that begins with sep=");
  const std::size_t other = header_.size() > 1 ? first.npos : first.find_first_of(";\t");
  if (other != first.npos)
    return complaint("wrong separator", "commas", first[other] == ';' ? "semicolons" : "tabs",
                     marks_hint);
  if (is_cut_) return cut_complaint();
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (header_.size() > 1 && header_[i].empty())
      return complaint("column " + std::to_string(i + 1) + " has no name", "a name", {},
                       "Remove trailing commas and row numbers (pandas: index=False)");
    for (std::size_t k = 0; k < i; ++k)
      if (header_[i] == header_[k])
        return complaint("column name repeated", {}, "'" + shortened(header_[i]) + "'");
  }
  return {};
}

Result<bool> CsvTable::next() {
  if (std::exchange(is_read_, false)) return true;
  auto more = next_line();
  if (!more || !*more) return more;
  if (auto done = check_line(); !done) return pass(std::move(done).error());
  return true;
}

Result<bool> CsvTable::next_line() {
  while (at_ < text_.size()) {
    const std::size_t end = std::min(text_.find(line_end_, at_), text_.size());
    const std::string_view line = trimmed(std::string_view(text_).substr(at_, end - at_), "\r");
    is_cut_ = end == text_.size() && !text_.ends_with('\r');
    at_ = end + 1;
    ++line_number_;
    if (line.size() > rules_.most_line_bytes)
      return complaint("line too long",
                       "at most " + std::to_string(rules_.most_line_bytes) + " bytes",
                       std::to_string(line.size()) + " bytes");
    const std::string_view text = trimmed(line);
    has_hash_ = text.starts_with('#');
    if (text.empty() || (has_hash_ && rules_.hash == CsvRules::Hash::comment)) continue;
    if (line.find('\0') != line.npos) return complaint("zero byte in a text file");
    if (auto done = split(line); !done) return pass(std::move(done).error());
    if (has_hash_ && rules_.hash == CsvRules::Hash::text_in_width) {
      const bool is_heading = header_.empty() && separator_ == 0 && has_label();
      if (!is_heading && fields_.size() != width_) {
        left_out_.push_back(line_number_);
        continue;
      }
      if (!is_heading) hash_rows_.push_back(line_number_);
    }
    return true;
  }
  has_hash_ = false;
  return false;
}

bool CsvTable::has_label() const {
  return std::ranges::any_of(
      fields_, [](const std::string& own) { return lower_case(trimmed(own, "# \t")) == "label"; });
}

Status CsvTable::check_line() {
  const bool fits = !rules_.equal_lines || width_ == 0 || fields_.size() == width_;
  if (is_cut_ && !(fits && tails_.fit(fields_.back()))) return cut_complaint();
  if (!fits)
    return complaint("wrong number of fields",
                     rules_.layout.empty() ? std::to_string(width_) : rules_.layout,
                     std::to_string(fields_.size()), width_hint());
  separator_ = line_separator_;
  if (width_ == 0) width_ = fields_.size();
  tails_.add(fields_.back());
  return {};
}

std::string CsvTable::width_hint() const {
  if (has_hash_) return hash_hint;
  if (fields_.size() > width_ && fields_.back().empty())
    return "Remove separators at the end of lines";
  const bool has_other_mark = std::ranges::any_of(
      fields_, [](const std::string& own) { return own.find(';') != own.npos; });
  return has_other_mark || fields_.size() > width_ ? marks_hint : "";
}

Status CsvTable::split(std::string_view line) {
  const auto has = [&](char c) { return line.find(c) != line.npos; };
  line_separator_ = separator_ != 0                      ? separator_
                    : !rules_.tabs_or_blanks || has(',') ? ','
                    : has('\t')                          ? '\t'
                                                         : ' ';
  const std::string tabbed = line_separator_ == ' ' ? with_tabs(line) : std::string();
  if (line_separator_ == ' ') line = tabbed;
  std::size_t count = 0;
  for (bool more = true; more; ++count) {
    if (count == rules_.most_columns)
      return complaint("too many columns", "at most " + std::to_string(rules_.most_columns));
    if (count == fields_.size()) fields_.emplace_back();
    if (!take_field(line, line_separator_ == ',' ? ',' : '\t', fields_[count], more))
      return complaint("quote not closed, or text after a closing quote", {}, {},
                       "Close the quote in the same line");
  }
  fields_.resize(count);
  return {};
}

void CsvTable::Tails::add(std::string_view field) {
  one_width &= lines == 0 || field.size() == width;
  one_precision &= lines == 0 || decimals_of(field) == decimals;
  width = field.size();
  decimals = decimals_of(field);
  ++lines;
}

// A cut of `1234` leaves `12`, which is a number too.
bool CsvTable::Tails::fit(std::string_view field) const {
  constexpr std::size_t fewest = 2;
  if (lines < fewest || field.empty()) return false;
  return (one_width && field.size() == width) ||
         (one_precision && decimals > 0 && decimals_of(field) == decimals);
}

Result<double> CsvTable::number(std::size_t column) const {
  const std::string& field = fields_[column];
  double value = 0;
  const std::errc error = parse_number(field, value).ec;
  if (error == std::errc() && std::isfinite(value)) return value;
  if (error == std::errc::result_out_of_range)
    return field_complaint(column, "number out of range", "0 or a magnitude of 5e-324 to 1.8e308",
                           {});
  const bool has_other_mark = field.find_first_of(",;\t") != field.npos;
  return field_complaint(column, "not a finite number", {},
                         has_other_mark ? marks_hint
                         : has_hash_    ? hash_hint
                                        : "");
}

Status CsvTable::append_numbers(std::span<const std::size_t> columns,
                                std::vector<double>& out) const {
  for (const std::size_t column : columns) {
    const auto value = number(column);
    if (!value) return pass(value.error());
    out.push_back(*value);
  }
  return {};
}

Status CsvTable::append_numbers(std::vector<double>& out) const {
  for (std::size_t column = 0; column < fields_.size(); ++column)
    if (auto done = append_numbers(std::array{column}, out); !done) return done;
  return {};
}

Result<double> CsvTable::time(std::size_t column, double ns_per_unit) const {
  constexpr double most_ns = 4.5e18;  // 142 years
  const auto value = number(column);
  if (!value || std::abs(*value * ns_per_unit) < most_ns) return value;
  return field_complaint(column, "time out of range", "within 142 years of 0",
                         "Check the unit of the time");
}

tl::unexpected<Error> CsvTable::field_complaint(std::size_t column, std::string message,
                                                std::string expected, std::string hint) const {
  auto out = complaint(std::move(message), std::move(expected),
                       "'" + shortened(fields_[column]) + "'", std::move(hint));
  out.value().where += header_.size() == fields_.size() ? " column " + shortened(header_[column])
                                                        : ": field " + std::to_string(column + 1);
  return out;
}

tl::unexpected<Error> CsvTable::complaint(std::string message, std::string expected,
                                          std::string got, std::string hint) const {
  return fail({.code = Errc::parse,
               .where = where(),
               .what = std::move(message),
               .expected = std::move(expected),
               .got = std::move(got),
               .hint = std::move(hint)});
}

tl::unexpected<Error> CsvTable::cut_complaint() const {
  return complaint("no line break at the end, the file may be truncated", {}, {},
                   "Add a line break if the file is complete");
}

std::vector<Warning> CsvTable::warnings() const {
  std::vector<Warning> out;
  if (!left_out_.empty())
    out.push_back(
        {"comments", name_ + ": lines that begin with # are left out: " + lines_text(left_out_)});
  if (!hash_rows_.empty())
    out.push_back({"hash_rows",
                   name_ + ": rows that begin with # are read as data: " + lines_text(hash_rows_)});
  return out;
}

bool is_csv_name(const std::filesystem::path& path) {
  return lower_case(path.extension().string()) == ".csv";
}

}  // namespace weft::daemon
