#pragma once
// Checksums, each named by its entry in the "Catalogue of parametrised CRC algorithms" (reveng).

#include <cstdint>

#include "protocols/base/bytes.hpp"

namespace weft {

/// CRC-16/IBM-3740 (often called CCITT-FALSE): poly 0x1021, init 0xFFFF; check("123456789") 0x29B1.
std::uint16_t crc16_ccitt(ByteView bytes, std::uint16_t seed = 0xFFFF);

/// CRC-16/MODBUS: poly 0x8005 reflected, init 0xFFFF; check("123456789") 0x4B37.
std::uint16_t crc16_modbus(ByteView bytes, std::uint16_t seed = 0xFFFF);

/// CRC-32/ISO-HDLC (zlib): check("123456789") 0xCBF43926. `seed` is the CRC of what came before.
std::uint32_t crc32(ByteView bytes, std::uint32_t seed = 0);

}  // namespace weft
