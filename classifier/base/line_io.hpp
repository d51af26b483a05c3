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

// A whole stored model: a first line with its kind, its text, and a last line with a checksum.

/// The checksum line that ends a file or the head of a file. The checksum covers `before` and
/// `more`. `keyword` ends in a blank.
std::string checksum_line(std::string_view keyword, std::string_view before,
                          std::string_view more = {});
inline constexpr std::string_view checksum_keyword = "crc32 ";

/// `header`, a line break, `body` (ends with a line break), and the checksum of both.
std::string with_checksum(std::string_view header, std::string_view body);

/// The text before the checksum line. Refuses a file without a correct checksum as its last line.
/// Errors: corrupt (the file is incomplete or altered).
Result<std::string_view> check_checksum(std::string_view text);

/// Refuses a first line that ends in a carriage return: a transfer in text mode changed the file.
Status check_line_ends(std::string_view beginning);

/// Builds a text line by line.
class LineWriter {
 public:
  /// Escapes line breaks and backslashes in `text`.
  void text(std::string_view keyword, std::string_view text);
  void number(std::string_view keyword, double value) { numbers(keyword, {&value, 1}); }
  void numbers(std::string_view keyword, std::span<const double> values);
  void counts(std::string_view keyword, std::span<const std::size_t> values);
  void count(std::string_view keyword, std::size_t value) { counts(keyword, {&value, 1}); }
  /// Appends the lines of another writer.
  void lines(std::string_view text) { out_ += text; }

  [[nodiscard]] const std::string& str() const { return out_; }

 private:
  std::string out_;
};

/// Reads such a text in order. It keeps the first problem with its line number. Every later value
/// is empty or zero, so callers check once, after the last read.
class LineReader {
 public:
  /// `lines_before`: number of lines before the text in its file, so that a problem names the line
  /// of the file.
  explicit LineReader(std::string_view text, std::size_t lines_before = 0)
      : rest_(text), line_(lines_before) {}

  std::string text(std::string_view keyword);
  /// Refuses NaN. Refuses infinity unless `infinite`.
  double number(std::string_view keyword);
  /// Requires a number above 0; not_negative() also accepts 0.
  double positive(std::string_view keyword);
  double not_negative(std::string_view keyword);
  /// Requires exactly `count` numbers.
  std::vector<double> numbers(std::string_view keyword, std::size_t count, bool infinite = false);
  /// Requires exactly `count` numbers above 0.
  std::vector<double> positives(std::string_view keyword, std::size_t count);
  std::vector<std::size_t> counts(std::string_view keyword, std::size_t count);
  /// Requires a count from `least` to `most`.
  std::size_t count(std::string_view keyword, std::size_t least, std::size_t most);
  /// Refuses a position outside a list of `size`. Call it after the line was read.
  void within(std::span<const std::size_t> positions, std::size_t size, std::string_view what);
  void finish();
  /// Bytes that are not read yet.
  [[nodiscard]] std::size_t left() const { return rest_.size(); }

  /// Records a problem of the line read last, unless one is already recorded.
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
