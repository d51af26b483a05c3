#include <algorithm>
#include <bit>
#include <charconv>
#include <optional>
#include <vector>

#include "daemon/storage/imprints/image_file.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {
namespace {

using classifier::imprint::Image;

struct ArrayHeader {
  std::string type;  // "<u2"
  bool columns_first = false;
  std::size_t rows = 0, cols = 0;
};

tl::unexpected<Error> npy_broken(const std::string& name, std::string what, std::string expected,
                                 std::string_view got = {}) {
  return fail({.code = Errc::parse,
               .where = name,
               .what = std::move(what),
               .expected = std::move(expected),
               .got = std::string(got.substr(0, 80))});
}

/// What follows 'key': in the header's dictionary.
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
  if (!type || !order || !shape || !type->starts_with('\''))
    return npy_broken(name, "the header is not an array's", "descr, fortran_order and shape", text);
  ArrayHeader out;
  const std::size_t end = type->find('\'', 1);
  if (end == std::string_view::npos) return npy_broken(name, "the type has no end", "'<u2'", *type);
  out.type = type->substr(1, end - 1);
  out.columns_first = order->starts_with("True");
  std::string_view sizes = shape->substr(0, shape->find(')'));
  const auto rows = leading_number(sizes);
  sizes.remove_prefix(std::min(sizes.find_first_not_of(" ,"), sizes.size()));
  const auto cols = leading_number(sizes);
  if (!rows || !cols || sizes.find_first_not_of(" ,") != std::string_view::npos)
    return npy_broken(name, "an imprint has two dimensions", "shape (rows, columns)", *shape);
  if (*rows == 0 || *cols == 0 || *rows > classifier::imprint::most_taxels / *cols)
    return npy_broken(name, "no imprint has this size", "1 to 16777216 taxels", *shape);
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

/// False for a type that is not read.
bool read_type(std::string_view type, ByteView bytes, std::vector<double>& out) {
  const bool big = type.starts_with('>');
  const std::string_view kind = type.substr(std::min<std::size_t>(1, type.size()));
  if (kind == "u1") read_numbers<std::uint8_t, std::uint8_t>(bytes, big, out);
  if (kind == "i1") read_numbers<std::uint8_t, std::int8_t>(bytes, big, out);
  if (kind == "u2") read_numbers<std::uint16_t, std::uint16_t>(bytes, big, out);
  if (kind == "i2") read_numbers<std::uint16_t, std::int16_t>(bytes, big, out);
  if (kind == "u4") read_numbers<std::uint32_t, std::uint32_t>(bytes, big, out);
  if (kind == "i4") read_numbers<std::uint32_t, std::int32_t>(bytes, big, out);
  if (kind == "f4") read_numbers<std::uint32_t, float>(bytes, big, out);
  if (kind == "f8") read_numbers<std::uint64_t, double>(bytes, big, out);
  constexpr std::string_view known[] = {"u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"};
  return (type.starts_with('<') || type.starts_with('>') || type.starts_with('|')) &&
         std::ranges::find(known, kind) != std::end(known);
}

}  // namespace

Result<Image> parse_image_npy(const std::string& name, std::string_view text) {
  if (!text.starts_with("\x93NUMPY") || text.size() < 10)
    return npy_broken(name, "no NumPy array", "a file that begins with \\x93NUMPY");
  const std::size_t wide = text[6] == 1 ? 2 : 4, start = 8 + wide;
  if (text[6] < 1 || text[6] > 3 || text.size() < start)
    return npy_broken(name, "an array file of another version", "1, 2 or 3");
  std::size_t length = 0;
  for (std::size_t i = 0; i < wide; ++i)
    length |= static_cast<std::size_t>(static_cast<unsigned char>(text[8 + i])) << (8 * i);
  if (length > text.size() - start)
    return npy_broken(name, "the header is cut short", "its length");
  const auto header = read_array_header(name, text.substr(start, length));
  if (!header) return pass(header.error());
  const std::string_view body = text.substr(start + length);
  const std::size_t taxels = header->rows * header->cols;
  const std::size_t width =
      header->type.empty() ? 0 : static_cast<std::size_t>(header->type.back() - '0');
  if (body.size() != taxels * width)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "the array has another number of bytes",
                 .expected = std::to_string(taxels * width),
                 .got = std::to_string(body.size())});
  std::vector<double> values(taxels);
  const std::vector<std::uint8_t> bytes(body.begin(), body.end());
  if (!read_type(header->type, bytes, values))
    return npy_broken(name, "values of this type are not read",
                      "u1, i1, u2, i2, u4, i4, f4 or f8 with its byte order", header->type);
  Image out(header->rows, header->cols);
  for (std::size_t r = 0; r < header->rows; ++r)
    for (std::size_t c = 0; c < header->cols; ++c)
      out(r, c) = values[header->columns_first ? c * header->rows + r : r * header->cols + c];
  return out;
}

}  // namespace weft::daemon
