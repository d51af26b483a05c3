#pragma once
// Bounded reading and writing of wire bytes, and checksums. Lengths are checked before every
// access. A reader that runs out becomes bad permanently and returns 0 from then on, so a decoder
// checks once at its end.

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace weft {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

enum class Endian { little, big };

/// Reads integers of one byte order from a fixed span.
template <Endian order>
class ByteReader {
 public:
  explicit ByteReader(ByteView bytes) : bytes_(bytes) {}

  template <class Int>
  Int read() {
    static_assert(std::is_integral_v<Int>);
    using U = std::make_unsigned_t<Int>;
    const ByteView raw = take(sizeof(Int));
    U value = 0;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      const std::size_t k = order == Endian::little ? raw.size() - 1 - i : i;
      value = static_cast<U>((static_cast<std::uint64_t>(value) << 8) | raw[k]);
    }
    return static_cast<Int>(value);
  }

  /// The next `count` bytes; an empty span (and a bad reader) if there are fewer.
  ByteView take(std::size_t count) {
    if (bad_ || count > bytes_.size() - at_) {
      bad_ = true;
      at_ = bytes_.size();  // remaining() becomes 0, so loops that read to the end terminate
      return {};
    }
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }

  [[nodiscard]] bool ok() const { return !bad_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - at_; }

 private:
  ByteView bytes_;
  std::size_t at_ = 0;
  bool bad_ = false;
};

/// Appends integers of one byte order to a growing buffer.
template <Endian order>
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& out) : out_(&out) {}

  template <class Int>
  ByteWriter& write(Int value) {
    static_assert(std::is_integral_v<Int>);
    const auto bits = static_cast<std::uint64_t>(static_cast<std::make_unsigned_t<Int>>(value));
    for (std::size_t i = 0; i < sizeof(Int); ++i) {
      const std::size_t k = order == Endian::little ? i : sizeof(Int) - 1 - i;
      out_->push_back(static_cast<std::uint8_t>(bits >> (8 * k)));
    }
    return *this;
  }

  ByteWriter& put(ByteView raw) {
    out_->insert(out_->end(), raw.begin(), raw.end());
    return *this;
  }

 private:
  Bytes* out_;
};

using LittleReader = ByteReader<Endian::little>;
using BigReader = ByteReader<Endian::big>;
using LittleWriter = ByteWriter<Endian::little>;
using BigWriter = ByteWriter<Endian::big>;

// Checksums, each named by its entry in the "Catalogue of parametrised CRC algorithms" (reveng).

/// CRC-16/IBM-3740 (often called CCITT-FALSE): poly 0x1021, init 0xFFFF; check("123456789") 0x29B1.
std::uint16_t crc16_ccitt(ByteView bytes, std::uint16_t seed = 0xFFFF);

/// CRC-16/MODBUS: poly 0x8005 reflected, init 0xFFFF; check("123456789") 0x4B37.
std::uint16_t crc16_modbus(ByteView bytes, std::uint16_t seed = 0xFFFF);

/// CRC-32/ISO-HDLC (zlib): check("123456789") 0xCBF43926. `seed` is the CRC of the preceding bytes.
std::uint32_t crc32(ByteView bytes, std::uint32_t seed = 0);

}  // namespace weft
