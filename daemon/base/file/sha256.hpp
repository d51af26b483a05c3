#pragma once
// SHA-256 (FIPS 180-4), for digests of content. Not a secret keeper: no constant-time claims.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "daemon/base/file/sha256_blocks.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {

using Sha256Digest = std::array<std::uint8_t, 32>;

class Sha256 {
 public:
  Sha256();  ///< with the fastest inner function that this processor has
  explicit Sha256(Sha256Compress compress) : compress_(compress) {}

  Sha256& update(ByteView bytes);
  Sha256& text(std::string_view characters);
  /// With its length in front [u32], so that two texts in a row are told from one.
  Sha256& sized_text(std::string_view characters) {
    return number(static_cast<std::uint32_t>(characters.size())).text(characters);
  }

  /// One number, little-endian; floating point by its IEEE 754 bits.
  template <class Number>
  Sha256& number(Number value) {
    auto raw = std::bit_cast<std::array<std::uint8_t, sizeof(Number)>>(value);
    if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(raw);
    return update(raw);
  }

  template <class Number>
  Sha256& numbers(std::span<const Number> values) {
    if constexpr (std::endian::native == std::endian::little) {
      return update({reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()});
    } else {
      for (const Number value : values) number(value);
      return *this;
    }
  }

  /// Ends the message. The object is of no further use.
  Sha256Digest finish();

 private:
  void pad(std::uint64_t message_bytes);

  Sha256Compress compress_;
  Sha256State state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                     0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> block_{};  ///< bytes that do not fill a block yet
  std::size_t held_ = 0;
  std::uint64_t total_bytes_ = 0;
};

/// Lower-case hexadecimal.
std::string to_hex(const Sha256Digest& digest);
std::string sha256_hex(std::string_view text);

}  // namespace weft::daemon
