#pragma once
// Comma-separated text, read strictly: every complaint carries file:line. Independent of the
// locale.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// A file's lines, one after the other, split into fields. RFC 4180 but for quoted line breaks,
/// which are refused, and for a last line without line break: whether its last number is whole
/// cannot be seen. Blanks around fields, blank lines, CRLF and a UTF-8 byte order mark are
/// accepted.
class CsvReader {
 public:
  static constexpr std::size_t max_file_bytes = std::size_t{256} << 20;
  static constexpr std::size_t max_line_bytes = std::size_t{1} << 20;
  static constexpr std::size_t max_columns = 8192;

  /// Reads the file and its header line. Errors: not_found, io, parse (empty, or too large).
  static Result<CsvReader> open(const std::filesystem::path& path);

  /// The same from text that somebody has read already; `name` stands for the file in complaints.
  static Result<CsvReader> from_text(std::string name, std::string text);

  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }
  /// The next line that is not blank: false at the end. As many fields as the header has.
  Result<bool> next();
  [[nodiscard]] const std::vector<std::string>& fields() const { return fields_; }

  /// A finite number in field `column` of the current line. One too small for a double is not
  /// taken for 0: what is read is what is written, or a complaint.
  Result<double> number(std::size_t column) const;
  /// The same of a time, so near to 0 that 64 bits hold the nanoseconds between any two.
  Result<double> time(std::size_t column, double ns_per_unit = 1e9) const;
  /// A failure at the current line.
  [[nodiscard]] tl::unexpected<Error> complaint(std::string message, std::string expected = {},
                                                std::string got = {}) const;
  [[nodiscard]] std::string where() const { return name_ + ":" + std::to_string(line_number_); }

 private:
  Result<bool> next_line();
  [[nodiscard]] Status check_separator() const;
  Status split(std::string_view line);

  std::string name_;
  std::string text_;
  std::size_t at_ = 0;
  std::size_t line_number_ = 0;
  std::vector<std::string> header_;
  std::vector<std::string> fields_;
};

/// Whether a file's name says that it is one: ".csv", in letters of either case.
bool is_csv_name(const std::filesystem::path& path);

}  // namespace weft::daemon
