#pragma once
// The reader of all tables of text: every complaint carries file:line. Independent of the locale.

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

/// What a table may look like; by default one with a heading, separated by commas.
struct CsvRules {
  enum class Heading : std::uint8_t {
    always,   ///< line 1, each name once
    never,    ///< numbers alone
    if_label  ///< a first line with the name `label`; behind a # too
  };
  enum class Hash : std::uint8_t {
    text,           ///< a line that begins with # is as any other
    comment,        ///< it is skipped
    text_in_width,  ///< it is a row where it has `width` fields, else left out with a warning
  };
  Heading heading = Heading::always;
  Hash hash = Hash::text;
  bool tabs_or_blanks = false;  ///< tabs or blanks separate where the first line has no comma
  bool equal_lines = true;      ///< all lines have as many fields
  std::size_t width = 0;        ///< that many; 0: as many as the first line
  std::string layout = {};      ///< of `width` fields, for people
  std::size_t most_columns = 8192;
  std::size_t most_line_bytes = std::size_t{1} << 20;
};

/// A file's lines, one after the other, split into fields. RFC 4180 but for quoted line breaks,
/// which are refused. Blanks around fields, blank lines, line ends of every system and a UTF-8 byte
/// order mark are accepted. A last line without line break is accepted where it looks like those
/// before: its last number has as many decimals as all of the column, or as many characters.
class CsvTable {
 public:
  static constexpr std::size_t max_file_bytes = std::size_t{256} << 20;
  static constexpr const char* hash_hint =
      "Lines that begin with # are not skipped here: leave them out, and a # before the names";

  /// Reads the file and its heading. Errors: not_found, io, range (too large), parse.
  static Result<CsvTable> open(const std::filesystem::path& path, CsvRules rules = {});
  /// The same from text that was read already; `name` stands for the file in complaints.
  static Result<CsvTable> from_text(std::string name, std::string text, CsvRules rules = {});

  // Columns are taken by their names; what nobody took is refused, or is taken as the rest.

  /// Empty where the table has no heading.
  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }
  std::optional<std::size_t> find_column(std::string_view name);
  /// The same of a column that there must be. Errors: parse, with the columns that there are.
  Result<std::size_t> take_column(std::string_view name);
  /// Columns `prefix`1 to `prefix`N, each once, and no other column that is not taken yet.
  Result<std::vector<std::size_t>> take_series(std::string_view prefix);
  std::vector<std::size_t> take_rest();
  /// Refuses a column that is not taken; `known` are those that there may be.
  [[nodiscard]] Status check_rest(const std::vector<std::string_view>& known) const;

  /// The next line that is not blank: false at the end.
  Result<bool> next();
  [[nodiscard]] const std::vector<std::string>& fields() const { return fields_; }
  /// A finite number in field `column` of the current line. One too small for a double is not
  /// taken for 0: what is read is what is written, or a complaint.
  [[nodiscard]] Result<double> number(std::size_t column) const;
  /// number() of each of `columns`, behind what `out` holds.
  Status append_numbers(std::span<const std::size_t> columns, std::vector<double>& out) const;
  /// The same of all fields.
  Status append_numbers(std::vector<double>& out) const;
  /// number() of a time, so near to 0 that 64 bits hold the nanoseconds between any two.
  [[nodiscard]] Result<double> time(std::size_t column, double ns_per_unit = 1e9) const;

  /// A failure at the current line.
  [[nodiscard]] tl::unexpected<Error> complaint(std::string message, std::string expected = {},
                                                std::string got = {}, std::string hint = {}) const;
  [[nodiscard]] std::string where() const { return name_ + ":" + std::to_string(line_number_); }
  /// Complete when the last line has been read.
  [[nodiscard]] std::vector<Warning> warnings() const;

 private:
  // How the fields of the last column end.
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
  bool is_read_ = false;   // the current line is the next one too
  bool has_hash_ = false;  // the current line begins with #
  std::vector<std::string> header_, fields_;
  std::vector<bool> taken_;
  Tails tails_;
  std::vector<std::size_t> left_out_, hash_rows_;  // numbers of lines
};

/// Whether a file's name says that it is one: ".csv", in letters of either case.
bool is_csv_name(const std::filesystem::path& path);

}  // namespace weft::daemon
