#include "daemon/storage/imprints/image_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "daemon/base/file/file_kind.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/csv_table.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {
namespace {

using classifier::imprint::Image;

constexpr std::string_view map_blanks = " \t\r\n\v\f";
constexpr std::size_t largest_map_value = 65535;

// Tokens of a grey map's text part; a comment runs from # to the end of its line.
class GreyMapTokens {
 public:
  explicit GreyMapTokens(std::string_view text) : text_(text) {}

  std::optional<std::size_t> number() {
    skip();
    std::size_t out = 0;
    const auto [stopped, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), out);
    if (error != std::errc()) return std::nullopt;
    at_ = static_cast<std::size_t>(stopped - text_.data());
    return out;
  }
  /// True if white space follows the last number. Without this check, `127` cut to `12` would pass.
  [[nodiscard]] bool is_ended() const {
    return at_ < text_.size() && map_blanks.find(text_[at_]) != std::string_view::npos;
  }
  /// True if only comments follow.
  [[nodiscard]] bool is_at_end() {
    skip();
    return at_ == text_.size();
  }
  /// The text after the single white-space character behind the last number.
  [[nodiscard]] std::string_view rest() const {
    return at_ < text_.size() ? text_.substr(at_ + 1) : std::string_view{};
  }

 private:
  // Skips white space and comments.
  void skip() {
    for (;;) {
      at_ = std::min(text_.find_first_not_of(map_blanks, at_), text_.size());
      if (at_ == text_.size() || text_[at_] != '#') return;
      at_ = std::min(text_.find('\n', at_), text_.size());
    }
  }

  std::string_view text_;
  std::size_t at_ = 2;  // after the magic number
};

Status read_plain_map(const std::string& name, GreyMapTokens& words, std::size_t most, Image& out) {
  for (double& value : out.data()) {
    const auto number = words.number();
    if (!number || *number > most)
      return fail({.code = Errc::parse,
                   .where = name,
                   .what = "taxel value missing or too large",
                   .expected = "0 to " + std::to_string(most)});
    value = static_cast<double>(*number);
  }
  if (!words.is_ended())
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "no line break at the end, the file may be truncated",
                 .hint = "Add a line break if the file is complete"});
  if (!words.is_at_end())
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "more taxels than in the header",
                 .expected = std::to_string(out.rows()) + " x " + std::to_string(out.cols())});
  return {};
}

Status read_binary_map(const std::string& name, std::string_view bytes, std::size_t most,
                       Image& out) {
  const std::size_t width = most < 256 ? 1 : 2;
  if (bytes.size() != width * out.data().size())
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "wrong number of bytes in the image",
                 .expected = std::to_string(width * out.data().size()),
                 .got = std::to_string(bytes.size())});
  for (std::size_t i = 0; i < out.data().size(); ++i) {
    std::size_t value = static_cast<unsigned char>(bytes[width * i]);
    if (width == 2) value = 256 * value + static_cast<unsigned char>(bytes[2 * i + 1]);
    if (value > most)
      return fail({.code = Errc::parse,
                   .where = name,
                   .what = "taxel value larger than the maximum in the header",
                   .expected = "0 to " + std::to_string(most)});
    out.data()[i] = static_cast<double>(value);
  }
  return {};
}

struct ArrayHeader {
  std::string type;  // "<u2"
  bool columns_first = false;
  std::size_t rows = 0, cols = 0;
};

/// The text after 'key': in the header's dictionary.
std::optional<std::string_view> find_header_entry(std::string_view header, std::string_view key) {
  const std::size_t at = header.find("'" + std::string(key) + "'");
  if (at == std::string_view::npos) return std::nullopt;
  const std::size_t colon = header.find(':', at);
  if (colon == std::string_view::npos) return std::nullopt;
  const std::size_t first = header.find_first_not_of(' ', colon + 1);
  if (first == std::string_view::npos) return std::nullopt;
  return header.substr(first);
}

std::optional<std::size_t> leading_number(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(" ("), text.size()));
  std::size_t out = 0;
  const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(stopped - text.data()));
  return out;
}

Result<ArrayHeader> read_array_header(const std::string& name, std::string_view text) {
  const auto type = find_header_entry(text, "descr"),
             order = find_header_entry(text, "fortran_order"),
             shape = find_header_entry(text, "shape");
  if (type && type->starts_with('['))
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "unsupported type of values",
                 .expected = "one number per taxel",
                 .got = "several fields",
                 .hint = "Save a single field: numpy.save(file, array['name'])"});
  if (!type || !order || !shape || !type->starts_with('\''))
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "invalid NumPy header",
                 .expected = "descr, fortran_order and shape",
                 .got = std::string(text.substr(0, 80))});
  ArrayHeader out;
  const std::size_t end = type->find('\'', 1);
  if (end == std::string_view::npos)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "type in the NumPy header has no closing quote",
                 .expected = "'<u2'",
                 .got = std::string(type->substr(0, 80))});
  out.type = type->substr(1, end - 1);
  out.columns_first = order->starts_with("True");
  std::string_view sizes = shape->substr(0, shape->find(')'));
  const auto rows = leading_number(sizes);
  sizes.remove_prefix(std::min(sizes.find_first_not_of(" ,"), sizes.size()));
  const auto cols = leading_number(sizes);
  const std::string got(shape->substr(0, std::min<std::size_t>(shape->find(')') + 1, 80)));
  if (!rows || !cols || sizes.find_first_not_of(" ,") != std::string_view::npos)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "array not two-dimensional",
                 .expected = "shape (rows, columns)",
                 .got = got});
  if (*rows == 0 || *cols == 0 || *rows > classifier::imprint::most_taxels / *cols)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "imprint size out of range",
                 .expected = "1 to 16777216 taxels",
                 .got = got});
  out.rows = *rows;
  out.cols = *cols;
  return out;
}

template <class Int, class As>
void read_numbers(ByteView bytes, bool big, std::vector<double>& out) {
  LittleReader little(bytes);
  BigReader large(bytes);
  for (double& value : out) {
    const Int bits = big ? large.read<Int>() : little.read<Int>();
    value = static_cast<double>(std::bit_cast<As>(bits));
  }
}

// IEEE 754 binary16.
struct Half {
  std::uint16_t bits;
  explicit operator double() const {
    constexpr int fraction_bits = 10, bias = 15, special = 31;
    const int exponent = (bits >> fraction_bits) & special;
    const int fraction = bits & 0x3FF;
    const double size = exponent == special ? (fraction == 0 ? HUGE_VAL : NAN)
                        : exponent == 0
                            ? std::ldexp(fraction, 1 - bias - fraction_bits)
                            : std::ldexp(fraction + 0x400, exponent - bias - fraction_bits);
    return (bits >> 15) != 0 ? -size : size;
  }
};

struct ArrayType {
  std::string_view name;
  std::size_t width;
  void (*read)(ByteView bytes, bool big, std::vector<double>& out);
};
constexpr std::array<ArrayType, 12> array_types{{
    {"b1", 1, read_numbers<std::uint8_t, std::uint8_t>},
    {"u1", 1, read_numbers<std::uint8_t, std::uint8_t>},
    {"i1", 1, read_numbers<std::uint8_t, std::int8_t>},
    {"u2", 2, read_numbers<std::uint16_t, std::uint16_t>},
    {"i2", 2, read_numbers<std::uint16_t, std::int16_t>},
    {"f2", 2, read_numbers<std::uint16_t, Half>},
    {"u4", 4, read_numbers<std::uint32_t, std::uint32_t>},
    {"i4", 4, read_numbers<std::uint32_t, std::int32_t>},
    {"f4", 4, read_numbers<std::uint32_t, float>},
    {"u8", 8, read_numbers<std::uint64_t, std::uint64_t>},
    {"i8", 8, read_numbers<std::uint64_t, std::int64_t>},
    {"f8", 8, read_numbers<std::uint64_t, double>},
}};

/// The values of an array from the `bytes` of its file.
Result<std::vector<double>> read_values(const std::string& name, const ArrayHeader& header,
                                        std::string_view bytes) {
  const std::string_view kind = std::string_view(header.type).substr(header.type.empty() ? 0 : 1);
  const auto* const type = std::ranges::find(array_types, kind, &ArrayType::name);
  if (type == array_types.end() ||
      std::string_view("<>|=").find(header.type.front()) == std::string_view::npos)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "unsupported type of values",
                 .expected = "b1, u1, i1, u2, i2, f2, u4, i4, f4, u8, i8 or f8 with its byte order",
                 .got = header.type.substr(0, 80),
                 .hint = "Save it with .astype('f4') or .astype('f8')"});
  std::vector<double> out(header.rows * header.cols);
  if (bytes.size() != out.size() * type->width)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "wrong number of bytes in the array",
                 .expected = std::to_string(out.size() * type->width),
                 .got = std::to_string(bytes.size())});
  type->read(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), header.type.front() == '>',
             out);
  // Beyond this, a double holds only every second, fourth ... whole number.
  constexpr double most_exact = 0x1p53;
  const auto far = std::ranges::find_if(out, [](double v) { return std::abs(v) >= most_exact; });
  if (kind.back() == '8' && kind.front() != 'f' && far != out.end())
    return fail({.code = Errc::range,
                 .where = name,
                 .what = "whole number too large for a double",
                 .expected = "magnitude below 2^53",
                 .hint = "Save it with .astype('f8') if its last digits do not matter"});
  return out;
}

bool is_zero_padded(std::string_view field) {
  return field.size() > 1 && field.front() == '0' &&
         field.find_first_not_of("0123456789") == field.npos;
}

/// Detects decimal commas in lines with an even number of fields. `behind`, `before`: some whole
/// number behind or before such a comma starts with a needless 0.
struct ZeroPadding {
  bool behind = false, before = false;
  void add(const std::vector<std::string>& fields) {
    for (std::size_t i = 0; fields.size() % 2 == 0 && i < fields.size(); ++i)
      (i % 2 == 0 ? before : behind) |= is_zero_padded(fields[i]);
  }
};

}  // namespace

Result<Image> read_image(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::string kind = path.extension().string();
  std::ranges::transform(kind, kind.begin(), [](char c) { return std::tolower(c); });
  if (kind != ".csv" && kind != ".txt" && kind != ".pgm" && kind != ".npy")
    return fail(with_file_kind({.code = Errc::unsupported,
                                .where = name,
                                .what = "unsupported file type for imprints",
                                .expected = ".csv, .txt, .pgm or .npy",
                                .got = kind},
                               path));
  const auto text = read_file(path, most_image_bytes);
  if (!text) return pass(text.error());
  auto image = kind == ".pgm"   ? parse_image_pgm(name, *text)
               : kind == ".npy" ? parse_image_npy(name, *text)
                                : parse_image_csv(name, *text);
  if (!image) return pass(image.error());
  if (auto ok = classifier::imprint::check(*image); !ok) return pass(ok.error(), name);
  return image;
}

Result<Image> parse_image_csv(const std::string& name, std::string_view text) {
  auto csv = CsvTable::from_text(name, std::string(text),
                                 {.heading = CsvRules::Heading::never,
                                  .hash = CsvRules::Hash::comment,
                                  .tabs_or_blanks = true,
                                  .most_columns = classifier::imprint::most_taxels,
                                  .most_line_bytes = most_image_bytes});
  if (!csv) return pass(csv.error());
  std::vector<double> values;
  ZeroPadding padding;
  auto more = csv->next();
  for (; more && *more; more = csv->next()) {
    padding.add(csv->fields());
    const std::size_t cols = csv->fields().size();
    if (values.size() + cols > classifier::imprint::most_taxels)
      return fail({.code = Errc::range, .where = csv->where(), .what = "too many taxels"});
    if (auto done = csv->append_numbers(values); !done) return pass(done.error());
  }
  if (!more) return pass(more.error());
  if (values.empty())
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "file contains no imprint",
                 .expected = "rows of numbers"});
  if (padding.behind && !padding.before && text.find(',') != text.npos)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "numbers after commas begin with 0, the commas may be decimal marks",
                 .hint = "Export the file again with points as decimal marks"});
  Image out(values.size() / csv->fields().size(), csv->fields().size());
  std::ranges::copy(values, out.data().begin());
  return out;
}

Result<Image> parse_image_pgm(const std::string& name, std::string_view text) {
  const bool plain = text.starts_with("P2"), binary = text.starts_with("P5");
  if (!plain && !binary)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "not a grey map (PGM)",
                 .expected = "a file that begins with P2 or P5"});
  GreyMapTokens words(text);
  const auto cols = words.number(), rows = words.number(), most = words.number();
  if (!cols || !rows || !most || *most < 1 || *most > largest_map_value)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "invalid header of a grey map",
                 .expected = "width, height and a largest value of 1 to 65535"});
  if (*rows == 0 || *cols == 0 || *rows > classifier::imprint::most_taxels / *cols ||
      *rows * *cols > text.size())
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "image size out of range",
                 .expected = "at most one taxel per byte of the file"});
  Image out(*rows, *cols);
  auto done = plain ? read_plain_map(name, words, *most, out)
                    : read_binary_map(name, words.rest(), *most, out);
  if (!done) return pass(done.error());
  return out;
}

Result<Image> parse_image_npy(const std::string& name, std::string_view text) {
  if (!text.starts_with("\x93NUMPY") || text.size() < 10)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "not a NumPy array",
                 .expected = "a file that begins with \\x93NUMPY",
                 .got = std::string(file_kind(text).name)});
  const std::size_t wide = text[6] == 1 ? 2 : 4, start = 8 + wide;
  if (text[6] < 1 || text[6] > 3 || text.size() < start)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "unsupported version of a NumPy file",
                 .expected = "1, 2 or 3"});
  std::size_t length = 0;
  for (std::size_t i = 0; i < wide; ++i)
    length |= static_cast<std::size_t>(static_cast<unsigned char>(text[8 + i])) << (8 * i);
  if (length > text.size() - start)
    return fail({.code = Errc::parse, .where = name, .what = "NumPy header truncated"});
  const auto header = read_array_header(name, text.substr(start, length));
  if (!header) return pass(header.error());
  const std::string_view body = text.substr(start + length);
  const auto values = read_values(name, *header, body);
  if (!values) return pass(values.error());
  Image out(header->rows, header->cols);
  for (std::size_t r = 0; r < header->rows; ++r)
    for (std::size_t c = 0; c < header->cols; ++c)
      out(r, c) = (*values)[header->columns_first ? c * header->rows + r : r * header->cols + c];
  return out;
}

}  // namespace weft::daemon
