#pragma once
// SHA-256 (FIPS 180-4) by OpenSSL, for digests of content.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "protocols/base/bytes.hpp"

struct evp_md_ctx_st;  // OpenSSL's EVP_MD_CTX

namespace weft::daemon {

using Sha256Digest = std::array<std::uint8_t, 32>;

/// Throws std::runtime_error if OpenSSL has no memory or no SHA-256.
class Sha256 {
 public:
  Sha256();

  Sha256& update(ByteView bytes);
  Sha256& text(std::string_view characters);
  /// Adds the length first [u32], so that two texts in a row differ from one joined text.
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

  /// Ends the message. The object must not be used afterwards.
  Sha256Digest finish();

 private:
  std::unique_ptr<evp_md_ctx_st, void (*)(evp_md_ctx_st*)> context_;
};

/// Lower-case hexadecimal.
std::string to_hex(const Sha256Digest& digest);
std::string sha256_hex(std::string_view text);

}  // namespace weft::daemon
