// Table-driven checksums; declared in bytes.hpp.

#include "protocols/base/bytes.hpp"

#include <array>

namespace weft {
namespace {

// [k][n]: CRC of byte n followed by k zero bytes, so that one step processes eight bytes.
constexpr auto make_tables16() {
  std::array<std::array<std::uint16_t, 256>, 8> tables{};
  for (unsigned n = 0; n < 256; ++n) {
    unsigned c = n << 8;
    for (int k = 0; k < 8; ++k) c = (c & 0x8000U) != 0 ? (c << 1) ^ 0x1021U : c << 1;
    tables[0][n] = static_cast<std::uint16_t>(c);
  }
  for (std::size_t k = 1; k < tables.size(); ++k)
    for (std::size_t n = 0; n < 256; ++n) {
      const unsigned before = tables[k - 1][n];
      tables[k][n] = static_cast<std::uint16_t>((before << 8) ^ tables[0][before >> 8]);
    }
  return tables;
}

constexpr auto make_reflected_table16() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned n = 0; n < 256; ++n) {
    unsigned c = n;
    for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xA001U ^ (c >> 1) : c >> 1;
    table[n] = static_cast<std::uint16_t>(c);
  }
  return table;
}

// As tables16, with reflected bits.
constexpr auto make_tables32() {
  std::array<std::array<std::uint32_t, 256>, 8> tables{};
  for (std::uint32_t n = 0; n < 256; ++n) {
    std::uint32_t c = n;
    for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1) : c >> 1;
    tables[0][n] = c;
  }
  for (std::size_t k = 1; k < tables.size(); ++k)
    for (std::size_t n = 0; n < 256; ++n)
      tables[k][n] = tables[0][tables[k - 1][n] & 0xFFU] ^ (tables[k - 1][n] >> 8);
  return tables;
}

constexpr auto tables16 = make_tables16();
constexpr auto reflected_table16 = make_reflected_table16();
constexpr auto tables32 = make_tables32();

std::uint32_t little32(ByteView bytes) {
  return bytes[0] | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16 |
         std::uint32_t{bytes[3]} << 24;
}

// Contribution of four bytes that `behind` bytes follow.
std::uint32_t four_bytes(std::uint32_t word, std::size_t behind) {
  return tables32[behind + 3][word & 0xFFU] ^ tables32[behind + 2][word >> 8 & 0xFFU] ^
         tables32[behind + 1][word >> 16 & 0xFFU] ^ tables32[behind][word >> 24];
}

}  // namespace

std::uint16_t crc16_ccitt(ByteView bytes, std::uint16_t seed) {
  unsigned c = seed;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8))
    c = tables16[7][(c >> 8) ^ bytes[0]] ^ tables16[6][(c & 0xFFU) ^ bytes[1]] ^
        tables16[5][bytes[2]] ^ tables16[4][bytes[3]] ^ tables16[3][bytes[4]] ^
        tables16[2][bytes[5]] ^ tables16[1][bytes[6]] ^ tables16[0][bytes[7]];
  for (const std::uint8_t b : bytes) c = ((c << 8) ^ tables16[0][((c >> 8) ^ b) & 0xFFU]) & 0xFFFFU;
  return static_cast<std::uint16_t>(c);
}

std::uint16_t crc16_modbus(ByteView bytes, std::uint16_t seed) {
  unsigned c = seed;
  for (const std::uint8_t b : bytes) c = reflected_table16[(c ^ b) & 0xFFU] ^ (c >> 8);
  return static_cast<std::uint16_t>(c);
}

std::uint32_t crc32(ByteView bytes, std::uint32_t seed) {
  std::uint32_t c = ~seed;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8))
    c = four_bytes(c ^ little32(bytes), 4) ^ four_bytes(little32(bytes.subspan(4)), 0);
  for (const std::uint8_t b : bytes) c = tables32[0][(c ^ b) & 0xFFU] ^ (c >> 8);
  return ~c;
}

}  // namespace weft
