#pragma once
// The reader of all text tables: every error has file:line. Independent of the locale.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Accepted form of a table; by default with a heading and commas.
struct CsvRules {
  enum class Heading : std::uint8_t {
    always,   ///< line 1, each name once
    never,    ///< numbers only
    if_label  ///< a first line with the name `label`; also after a #
  };
  enum class Hash : std::uint8_t {
    text,     ///< a line that starts with # is like any other
    comment,  ///< such a line is skipped
    /// Such a line is a row if it has `width` fields, otherwise skipped with a warning.
    text_in_width,
  };
  Heading heading = Heading::always;
  Hash hash = Hash::text;
  bool tabs_or_blanks = false;  ///< tabs or blanks separate if the first line has no comma
  bool equal_lines = true;      ///< all lines have the same number of fields
  std::size_t width = 0;        ///< required number of fields; 0: as in the first line
  std::string layout = {};      ///< names of the `width` fields, for people
  std::size_t most_columns = 8192;
  std::size_t most_line_bytes = std::size_t{1} << 20;
};

/// The lines of a file, one after the other, split into fields. RFC 4180, but quoted line breaks
/// are refused. Accepts blanks around fields, blank lines, line ends of every system and a UTF-8
/// byte order mark. Accepts a last line without line break only if it looks like the earlier ones:
/// its last field has the number of decimals, or of characters, that all fields of the column have.
class CsvTable {
 public:
  static constexpr std::size_t max_file_bytes = std::size_t{256} << 20;
  static constexpr const char* hash_hint =
      "Remove lines that begin with #, and a # before the column names";

  /// Reads the file and its heading. Errors: not_found, io, range (too large), parse.
  static Result<CsvTable> open(const std::filesystem::path& path, CsvRules rules = {});
  /// The same from text in memory; `name` replaces the file in errors.
  static Result<CsvTable> from_text(std::string name, std::string text, CsvRules rules = {});

  // Columns are taken by their names. Columns that are not taken are refused, or taken as the rest.

  /// Empty if the table has no heading.
  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }
  std::optional<std::size_t> find_column(std::string_view name);
  /// find_column() for a required column. Errors: parse, with the existing columns.
  Result<std::size_t> take_column(std::string_view name);
  /// Columns `prefix`1 to `prefix`N, each once. Errors: parse, also for another column that is not
  /// taken yet.
  Result<std::vector<std::size_t>> take_series(std::string_view prefix);
  std::vector<std::size_t> take_rest();
  /// Refuses a column that is not taken; `known` are the possible ones.
  [[nodiscard]] Status check_rest(const std::vector<std::string_view>& known) const;

  /// Reads the next line that is not blank; false at the end.
  Result<bool> next();
  [[nodiscard]] const std::vector<std::string>& fields() const { return fields_; }
  /// A finite number in field `column` of the current line. Errors: parse, also for a number too
  /// small for a double: it is not read as 0.
  [[nodiscard]] Result<double> number(std::size_t column) const;
  /// Appends number() of each of `columns` to `out`.
  Status append_numbers(std::span<const std::size_t> columns, std::vector<double>& out) const;
  /// The same for all fields.
  Status append_numbers(std::vector<double>& out) const;
  /// number() of a time, limited so that the nanoseconds between any two fit into 64 bits.
  [[nodiscard]] Result<double> time(std::size_t column, double ns_per_unit = 1e9) const;

  /// An error at the current line.
  [[nodiscard]] tl::unexpected<Error> complaint(std::string message, std::string expected = {},
                                                std::string got = {}, std::string hint = {}) const;
  [[nodiscard]] std::string where() const { return name_ + ":" + std::to_string(line_number_); }
  /// Complete when the last line has been read.
  [[nodiscard]] std::vector<Warning> warnings() const;

 private:
  // Statistics of the last column's fields: widths and decimals.
  struct Tails {
    std::size_t lines = 0, width = 0, decimals = 0;
    bool one_width = true, one_precision = true;
    void add(std::string_view field);
    [[nodiscard]] bool fit(std::string_view field) const;
  };

  Status read_heading();
  [[nodiscard]] Status check_heading() const;
  Result<bool> next_line();
  [[nodiscard]] bool has_label() const;
  Status check_line();
  [[nodiscard]] std::string width_hint() const;
  Status split(std::string_view line);
  [[nodiscard]] std::string missing_hint(std::string_view name) const;
  [[nodiscard]] std::size_t find_line(std::string_view name) const;
  [[nodiscard]] tl::unexpected<Error> cut_complaint() const;
  [[nodiscard]] tl::unexpected<Error> field_complaint(std::size_t column, std::string message,
                                                      std::string expected, std::string hint) const;

  CsvRules rules_;
  std::string name_, text_;
  char line_end_ = '\n';
  char separator_ = 0;       // 0: no line has been accepted
  char line_separator_ = 0;  // of the current line; ' ': runs of blanks
  std::size_t at_ = 0, line_number_ = 0, width_ = 0;
  bool is_cut_ = false;    // the current line has no line break
  bool is_read_ = false;   // next() returns the current line again
  bool has_hash_ = false;  // the current line begins with #
  std::vector<std::string> header_, fields_;
  std::vector<bool> taken_;
  Tails tails_;
  std::vector<std::size_t> left_out_, hash_rows_;  // line numbers
};

/// Whether the file name ends with ".csv", in upper or lower case.
bool is_csv_name(const std::filesystem::path& path);

}  // namespace weft::daemon
