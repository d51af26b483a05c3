#include "classifier/base/checksummed_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <istream>
#include <iterator>
#include <ostream>

#include "protocols/base/bytes.hpp"

namespace weft::classifier {
namespace {

constexpr std::string_view crc_keyword = "crc32 ";
constexpr std::size_t crc_line_bytes = 6 + 8 + 1;

std::uint32_t compute_crc(std::string_view text, std::uint32_t before = 0) {
  return crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, before);
}

std::string crc_line(std::uint32_t crc) {
  std::array<char, 8> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + 8, crc, 16).ptr;
  const std::string hex(digits.data(), end);
  return std::string(crc_keyword) + std::string(8 - hex.size(), '0') + hex + "\n";
}

}  // namespace

std::string with_checksum(std::string_view header, std::string_view body) {
  const std::string whole = std::string(header) + "\n" + std::string(body);
  return whole + crc_line(compute_crc(whole));
}

Result<std::string_view> check_checksum(std::string_view text, std::size_t begin) {
  const std::size_t at = text.size() < crc_line_bytes ? 0 : text.size() - crc_line_bytes;
  const std::string_view trailer = text.substr(at);
  if (at < begin || !trailer.starts_with(crc_keyword) || trailer.back() != '\n')
    return fail({.code = Errc::corrupt,
                 .what = "the model file was cut short",
                 .expected = "a last line with a checksum"});
  if (trailer != crc_line(compute_crc(text.substr(0, at))))
    return fail(
        {.code = Errc::corrupt, .what = "the model file was altered: its checksum disagrees"});
  return text.substr(begin, at - begin);
}

bool is_of_kind(std::string_view beginning, std::string_view header) {
  return beginning.starts_with(header.substr(0, header.rfind(' ') + 1));
}

Status write_checksummed(std::string_view header, std::string_view body, std::ostream& out) {
  const std::string first = std::string(header) + "\n";
  out << first << body << crc_line(compute_crc(body, compute_crc(first)));
  if (!out.flush()) return fail({.code = Errc::io, .what = "cannot write the model"});
  return {};
}

Result<std::string> read_checksummed(std::string_view header, std::string_view not_this,
                                     std::istream& in) {
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return fail({.code = Errc::io, .what = "cannot read the model"});
  const std::string first = text.substr(0, text.find('\n'));
  if (!is_of_kind(first, header))
    return fail({.code = Errc::parse,
                 .what = std::string(not_this),
                 .expected = std::string(header),
                 .got = first.substr(0, 40)});
  if (first != header)
    return fail({.code = Errc::unsupported,
                 .what = "a model file of another version",
                 .expected = std::string(header),
                 .got = first.substr(0, 40),
                 .hint = "Train the model again with this version"});
  const auto body = check_checksum(text, std::min(first.size() + 1, text.size()));
  if (!body) return pass(body.error());
  return std::string(*body);
}

}  // namespace weft::classifier
