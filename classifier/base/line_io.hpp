#pragma once
// Lines of a keyword and its values: the text form of stored models. Numbers are written as the
// shortest text that reads back as the same double.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::classifier {

// A stored model as a whole: a first line that says what it is, its text, a last line with a
// checksum.

/// The last line of a file, or of its head, which is `before` and `more`; `keyword` ends in a
/// blank.
std::string checksum_line(std::string_view keyword, std::string_view before,
                          std::string_view more = {});
inline constexpr std::string_view checksum_keyword = "crc32 ";

/// `header` and a line break, `body`, which ends with one, and the checksum of both.
std::string with_checksum(std::string_view header, std::string_view body);

/// Refuses a whole file whose last line is not its checksum; else what lies before that line.
/// Errors: corrupt, cut short or altered.
Result<std::string_view> check_checksum(std::string_view text);

/// Refuses a first line that ends in a carriage return: a transfer as text changed the file.
Status check_line_ends(std::string_view beginning);

/// Builds a text line by line.
class LineWriter {
 public:
  /// Line breaks and backslashes in `text` are escaped.
  void text(std::string_view keyword, std::string_view text);
  void number(std::string_view keyword, double value) { numbers(keyword, {&value, 1}); }
  void numbers(std::string_view keyword, std::span<const double> values);
  void counts(std::string_view keyword, std::span<const std::size_t> values);
  void count(std::string_view keyword, std::size_t value) { counts(keyword, {&value, 1}); }
  /// What another writer has written.
  void lines(std::string_view text) { out_ += text; }

  [[nodiscard]] const std::string& str() const { return out_; }

 private:
  std::string out_;
};

/// Reads such a text in order. The first problem is kept with its line, and every later value is
/// empty or zero, so that a sequence of reads is checked once, at its end.
class LineReader {
 public:
  /// `lines_before`: that precede the text in its file, so that a problem names the file's line.
  explicit LineReader(std::string_view text, std::size_t lines_before = 0)
      : rest_(text), line_(lines_before) {}

  std::string text(std::string_view keyword);
  /// NaN is refused; infinity as well unless `infinite`.
  double number(std::string_view keyword);
  /// A number above 0, or 0 as well.
  double positive(std::string_view keyword);
  double not_negative(std::string_view keyword);
  /// Exactly `count` of them.
  std::vector<double> numbers(std::string_view keyword, std::size_t count, bool infinite = false);
  /// Exactly `count` numbers above 0.
  std::vector<double> positives(std::string_view keyword, std::size_t count);
  std::vector<std::size_t> counts(std::string_view keyword, std::size_t count);
  /// From `least` to `most`.
  std::size_t count(std::string_view keyword, std::size_t least, std::size_t most);
  /// Refuses a position in a list of `size` that is not there. Call it after the line was read.
  void within(std::span<const std::size_t> positions, std::size_t size, std::string_view what);
  void finish();
  /// Bytes that are not read yet.
  [[nodiscard]] std::size_t left() const { return rest_.size(); }

  /// Notes a problem of the line read last, unless there is one already.
  void refuse(std::string message, std::string expected = {}, std::string got = {});
  [[nodiscard]] bool ok() const { return status_.has_value(); }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  std::string_view values_of(std::string_view keyword);
  template <class Number>
  std::vector<Number> list(std::string_view keyword, std::size_t count);

  std::string_view rest_;
  std::size_t line_ = 0;
  Status status_;
};

}  // namespace weft::classifier
