#include "daemon/base/text/csv.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

constexpr std::string_view blanks = " \t";

/// Takes one field and the comma behind it off the front of `rest`. Nothing when a quote is not
/// closed or is followed by anything but a comma. `more` tells whether there was a comma.
bool read_quoted(std::string_view& rest, std::string& field, bool& more) {
  field.clear();
  for (std::size_t i = 1; i < rest.size(); ++i) {
    if (rest[i] != '"') {
      field += rest[i];
    } else if (i + 1 < rest.size() && rest[i + 1] == '"') {
      field += rest[i++];
    } else {
      const std::string_view behind = trimmed(rest.substr(i + 1, rest.find(',', i) - i - 1));
      const std::size_t comma = rest.find(',', i);
      more = comma != std::string_view::npos;
      rest = more ? rest.substr(comma + 1) : std::string_view{};
      return behind.empty();
    }
  }
  return false;
}

void read_plain(std::string_view& rest, std::string& field, bool& more) {
  const std::size_t comma = rest.find(',');
  field.assign(trimmed(rest.substr(0, comma)));
  more = comma != std::string_view::npos;
  rest = more ? rest.substr(comma + 1) : std::string_view{};
}

/// For messages: what a person needs to recognise it, whatever somebody put into the file.
std::string shortened(std::string_view text) {
  constexpr std::size_t enough = 40;
  return text.size() <= enough ? std::string(text) : std::string(text.substr(0, enough)) + "...";
}

Result<std::string> read_whole(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    return fail({.code = Errc::not_found, .where = path, .what = "no such file"});
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error)
    return fail({.code = Errc::io, .where = path, .what = "unreadable", .got = error.message()});
  if (bytes > CsvReader::max_file_bytes)
    return fail({.code = Errc::parse,
                 .where = path,
                 .what = "too large for a CSV file",
                 .expected = "at most " + std::to_string(CsvReader::max_file_bytes) + " bytes",
                 .got = std::to_string(bytes)});
  std::string text(static_cast<std::size_t>(bytes), '\0');
  std::ifstream in(path, std::ios::binary);
  if (!in.read(text.data(), static_cast<std::streamsize>(text.size())))
    return fail({.code = Errc::io, .where = path, .what = "unreadable"});
  return text;
}

}  // namespace

Result<CsvReader> CsvReader::open(const std::filesystem::path& path) {
  auto text = read_whole(path);
  if (!text) return pass(std::move(text).error());
  return from_text(path.string(), std::move(*text));
}

Result<CsvReader> CsvReader::from_text(std::string name, std::string text) {
  CsvReader reader;
  reader.name_ = std::move(name);
  reader.text_ = std::move(text);
  if (reader.text_.starts_with("\xEF\xBB\xBF")) reader.at_ = 3;
  auto line = reader.next_line();
  if (!line) return pass(std::move(line).error());
  if (!*line)
    return fail({.code = Errc::parse,
                 .where = reader.name_,
                 .what = "the file is empty",
                 .expected = "a header line"});
  reader.header_ = reader.fields_;
  if (auto commas = reader.check_separator(); !commas) return pass(std::move(commas).error());
  for (std::size_t i = 0; i < reader.header_.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (reader.header_[i] == reader.header_[k])
        return reader.complaint("two columns of the same name", {},
                                "'" + shortened(reader.header_[i]) + "'");
  return reader;
}

// Every table here has two columns or more. A comma between digits may be a decimal mark then: such
// a file is not guessed at.
Status CsvReader::check_separator() const {
  const std::size_t other =
      header_.size() > 1 ? std::string::npos : header_.front().find_first_of(";\t");
  if (other == std::string::npos) return {};
  return fail({.code = Errc::parse,
               .where = where(),
               .what = "not separated by commas",
               .expected = "commas",
               .got = header_.front()[other] == ';' ? "semicolons" : "tabs",
               .hint = "Export it again with commas between fields and points as decimal marks"});
}

Result<bool> CsvReader::next() {
  auto line = next_line();
  if (!line || !*line || fields_.size() == header_.size()) return line;
  return complaint("wrong number of fields", std::to_string(header_.size()),
                   std::to_string(fields_.size()));
}

Result<bool> CsvReader::next_line() {
  while (at_ < text_.size()) {
    const std::size_t end = text_.find('\n', at_);
    const bool ends_with_file = end == std::string::npos;
    std::string_view line = std::string_view(text_).substr(at_, end - at_);
    at_ = ends_with_file ? text_.size() : end + 1;
    ++line_number_;
    if (line.size() > max_line_bytes)
      return complaint("the line is too long", "at most " + std::to_string(max_line_bytes),
                       std::to_string(line.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (trimmed(line).empty()) continue;
    if (line.find('\0') != std::string_view::npos) return complaint("a zero byte: not a text file");
    if (ends_with_file)
      return fail({.code = Errc::parse,
                   .where = where(),
                   .what = "the last line has no line break: the file may be cut short",
                   .expected = "a line break at the end",
                   .hint = "Add a newline if the file is whole"});
    if (auto done = split(line); !done) return pass(std::move(done).error());
    return true;
  }
  return false;
}

Status CsvReader::split(std::string_view line) {
  std::size_t count = 0;
  for (bool more = true; more; ++count) {
    if (count == max_columns)
      return complaint("too many columns", "at most " + std::to_string(max_columns));
    if (count == fields_.size()) fields_.emplace_back();
    const std::size_t first = std::min(line.find_first_not_of(blanks), line.size());
    if (line.substr(first).starts_with('"')) {
      line.remove_prefix(first);
      if (!read_quoted(line, fields_[count], more))
        return complaint("a quote that is not closed, or text behind a closing quote");
    } else {
      read_plain(line, fields_[count], more);
    }
  }
  fields_.resize(count);
  return {};
}

Result<double> CsvReader::number(std::size_t column) const {
  const std::string& field = fields_[column];
  double value = 0;
  const char* end = field.data() + field.size();
  const auto [stopped, error] = std::from_chars(field.data(), end, value);
  if (error == std::errc() && stopped == end && std::isfinite(value)) return value;
  const bool too_far = error == std::errc::result_out_of_range && stopped == end;
  auto failure = complaint(too_far ? "a number that no double can hold" : "not a finite number",
                           too_far ? "0, or 5e-324 to 1.8e308 of either sign" : "",
                           "'" + shortened(field) + "'");
  failure.value().where += " column " + shortened(header_[column]);
  return failure;
}

Result<double> CsvReader::time(std::size_t column, double ns_per_unit) const {
  constexpr double most_ns = 4.5e18;  // 142 years
  const auto value = number(column);
  if (!value || std::abs(*value * ns_per_unit) < most_ns) return value;
  auto failure = complaint("a time beyond all reason", "within 142 years of 0",
                           "'" + shortened(fields_[column]) + "'");
  failure.value().where += " column " + shortened(header_[column]);
  failure.value().hint = "Is it in another unit, as milliseconds?";
  return failure;
}

bool is_csv_name(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension == ".csv";
}

tl::unexpected<Error> CsvReader::complaint(std::string message, std::string expected,
                                           std::string got) const {
  return fail({.code = Errc::parse,
               .where = where(),
               .what = std::move(message),
               .expected = std::move(expected),
               .got = std::move(got)});
}

}  // namespace weft::daemon
