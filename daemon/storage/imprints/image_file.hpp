#pragma once
// Imprints as other programs write them: CSV, PGM, NumPy.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/imprint/image.hpp"
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
  /// A failure at the current line. Code: parse.
  [[nodiscard]] tl::unexpected<Error> complaint(std::string what, std::string expected = {},
                                                std::string got = {}) const;
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

/// Larger files are refused before they are read.
inline constexpr std::uintmax_t most_image_bytes = std::uintmax_t{256} << 20;

/// A matrix of numbers without a header, a line a row; commas or blanks between; blank lines and
/// lines that begin with # are skipped. Errors: parse with name:line; range for too many taxels.
Result<classifier::imprint::Image> parse_image_csv(const std::string& name, std::string_view text);

/// Netpbm's grey map, plain (P2) or binary (P5), one image, up to 16 bits. Values as they stand.
Result<classifier::imprint::Image> parse_image_pgm(const std::string& name, std::string_view text);

/// NumPy's .npy, versions 1 to 3: two dimensions in either order of memory; u1, i1, and u2, i2, u4,
/// i4, f4, f8 of either byte order.
Result<classifier::imprint::Image> parse_image_npy(const std::string& name, std::string_view text);

/// By the extension: .csv, .txt, .pgm or .npy. The image is checked: finite, of a usable size.
Result<classifier::imprint::Image> read_image(const std::filesystem::path& path);

}  // namespace weft::daemon
