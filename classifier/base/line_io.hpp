#pragma once
// Lines of a keyword and its values: the text form of stored models. Numbers are written as the
// shortest text that reads back as the same double.

#include <cstddef>
#include <iosfwd>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::classifier {

// A stored model as a whole: a first line that says what it is, its text, a last line with a
// checksum.

/// `header` and a line break, `body`, which ends with one, and the checksum of both.
std::string with_checksum(std::string_view header, std::string_view body);

/// What lies between the first `begin` bytes and the checksum of a whole file. Errors: corrupt, cut
/// short or altered.
Result<std::string_view> check_checksum(std::string_view text, std::size_t begin);

/// Whether a text that begins so is of the kind that `header`, "weft-imprint-model 1", names: of
/// whatever version.
bool is_of_kind(std::string_view beginning, std::string_view header);
/// Refuses a first line that ends in a carriage return: a transfer as text changed the file.
Status check_line_ends(std::string_view beginning);

/// with_checksum() to a stream. Errc::io when it fails.
Status write_checksummed(std::string_view header, std::string_view body, std::ostream& out);

/// The body of a file of exactly this `header`; `not_this` says what another file is not. Errors:
/// parse (another kind of file), unsupported (another version), corrupt (cut short or altered), io.
Result<std::string> read_checksummed(std::string_view header, std::string_view not_this,
                                     std::istream& in);

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
  explicit LineReader(std::string_view text) : rest_(text) {}

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
