#pragma once
// Text of numbers, line by line.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// The lines of a text that say something: blank ones and those that begin with # are skipped.
class NumberLines {
 public:
  NumberLines(std::string name, std::string_view text) : name_(std::move(name)), text_(text) {}

  /// Goes to the next line; false at the end.
  bool next();
  /// Refuses a last line without a line break: of `1234` a cut leaves `12`, a number too. Errors:
  /// parse, with name:line.
  [[nodiscard]] Status check_end() const;
  /// Of the current line, without blanks around them; separated by commas or, where there is none,
  /// by blanks.
  [[nodiscard]] const std::vector<std::string_view>& fields() const { return fields_; }
  /// A finite number in field `at`. Errors: parse, with name:line.
  [[nodiscard]] Result<double> number(std::size_t at) const;
  [[nodiscard]] bool is_number(std::size_t at) const;
  /// "file.csv:12".
  [[nodiscard]] std::string where() const { return name_ + ":" + std::to_string(line_); }

 private:
  void split(std::string_view line);
  [[nodiscard]] std::optional<double> value(std::size_t at) const;

  std::string name_;
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
  bool broken_off_ = false;  // the current line has no line break
  std::vector<std::string_view> fields_;
};

}  // namespace weft::daemon
