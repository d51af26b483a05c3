#include "protocols/base/crc.hpp"

#include <array>

namespace weft {
namespace {

constexpr auto make_table16() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned n = 0; n < 256; ++n) {
    unsigned c = n << 8;
    for (int k = 0; k < 8; ++k) c = (c & 0x8000U) != 0 ? (c << 1) ^ 0x1021U : c << 1;
    table[n] = static_cast<std::uint16_t>(c);
  }
  return table;
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

constexpr auto make_table32() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t n = 0; n < 256; ++n) {
    std::uint32_t c = n;
    for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1) : c >> 1;
    table[n] = c;
  }
  return table;
}

constexpr auto table16 = make_table16();
constexpr auto reflected_table16 = make_reflected_table16();
constexpr auto table32 = make_table32();

}  // namespace

std::uint16_t crc16_ccitt(ByteView bytes, std::uint16_t seed) {
  unsigned c = seed;
  for (const std::uint8_t b : bytes) c = ((c << 8) ^ table16[((c >> 8) ^ b) & 0xFFU]) & 0xFFFFU;
  return static_cast<std::uint16_t>(c);
}

std::uint16_t crc16_modbus(ByteView bytes, std::uint16_t seed) {
  unsigned c = seed;
  for (const std::uint8_t b : bytes) c = reflected_table16[(c ^ b) & 0xFFU] ^ (c >> 8);
  return static_cast<std::uint16_t>(c);
}

std::uint32_t crc32(ByteView bytes, std::uint32_t seed) {
  std::uint32_t c = ~seed;
  for (const std::uint8_t b : bytes) c = table32[(c ^ b) & 0xFFU] ^ (c >> 8);
  return ~c;
}

}  // namespace weft
