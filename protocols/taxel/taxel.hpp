#pragma once
// Weft's own framing between the tactile sensor's microcontroller and the host. No published
// framing exists for this sensor. Layout: README.md of this folder. Little-endian.

#include <array>
#include <cstdint>
#include <span>

#include "protocols/base/bytes.hpp"
#include "protocols/base/sequence.hpp"
#include "protocols/base/stream_buffer.hpp"

namespace weft::protocols::taxel {

inline constexpr std::array<std::uint8_t, 2> sync{0xA5, 0x5A};
inline constexpr std::uint8_t version = 1;
inline constexpr std::size_t max_taxels = 64;

/// One scan of all taxels. Plain numbers, no heap.
struct Frame {
  std::uint16_t sequence = 0;
  std::uint32_t device_us = 0;    ///< the microcontroller's clock at the end of the scan; wraps
  std::uint8_t taxel_count = 16;  ///< 1 to max_taxels
  std::array<std::uint16_t, max_taxels> counts{};  ///< the first taxel_count are meant
  std::uint16_t proximity_counts = 0;
  std::uint16_t ambient_counts = 0;

  [[nodiscard]] std::span<const std::uint16_t> taxels() const {
    return std::span(counts).first(taxel_count);
  }
  bool operator==(const Frame&) const = default;
};

/// Bytes of a frame with `taxels` taxels: 48 for 16.
constexpr std::size_t frame_size(std::size_t taxels) {
  return 10 + 2 * taxels + 4 + 2;
}

/// Appends a frame; its taxel_count is 1 to max_taxels. Allocates nothing when `out` has room.
void append(Bytes& out, const Frame& frame);

/// push() a chunk, then call next() until it returns false. Any chunking of a stream gives the same
/// frames. Bytes outside a frame are skipped; after a wrong CRC the search goes on one byte
/// further, so that a good frame behind a damaged one is not lost.
class Splitter {
 public:
  /// Bytes that next() has not taken yet, at most; more than any link delivers in one chunk.
  static constexpr std::size_t capacity = 65536;

  void push(ByteView bytes) { buffer_.push(bytes); }
  bool next(Frame& frame);
  /// Forgets a frame in progress; the counters stay.
  void clear() { buffer_.clear(); }

  [[nodiscard]] std::uint64_t skipped_bytes() const { return buffer_.skipped_bytes(); }
  /// Frames with a plausible head and a wrong check value.
  [[nodiscard]] std::uint64_t crc_errors() const { return crc_errors_; }

 private:
  StreamBuffer buffer_{capacity};
  std::uint64_t crc_errors_ = 0;
};

/// For Frame::sequence.
using SequenceTracker = BasicSequenceTracker<std::uint16_t>;

}  // namespace weft::protocols::taxel
