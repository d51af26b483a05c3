#pragma once
// Weft's own framing between a vibration sensor (a 3-axis accelerometer, a microphone) and the
// host. No reference gives a frame form for such a sensor. Layout: README.md of this folder.
// Little-endian.

#include <array>
#include <cstdint>
#include <span>

#include "protocols/base/bytes.hpp"
#include "protocols/base/sequence.hpp"
#include "protocols/base/stream_buffer.hpp"

namespace weft::protocols::vibro {

inline constexpr std::array<std::uint8_t, 2> sync{0xD6, 0x6D};
inline constexpr std::uint8_t version = 1;
inline constexpr std::size_t head_size = 14;
inline constexpr std::size_t tail_size = 4;  ///< CRC-32
inline constexpr std::size_t description_size = 32;
inline constexpr std::size_t axes = 3;
inline constexpr std::size_t max_values = 1536;  ///< of one block: 512 readings of three axes

enum class Kind : std::uint8_t {
  description = 0,   ///< who the sensor is and what it sends; once a second
  acceleration = 1,  ///< a block of readings x, y, z
  sound = 2          ///< a block of readings of the microphone
};

/// One channel as the sensor describes it. One count is range / full_scale_counts.
struct ChannelDescription {
  std::uint32_t rate_mhz = 0;     ///< readings a second [mHz]; 0: the sensor has no such channel
  std::uint32_t range_micro = 0;  ///< at full scale [um/s2] or [uPa]
  std::uint16_t full_scale_counts = 0;
  std::uint16_t block_readings = 0;  ///< readings in each frame

  bool operator==(const ChannelDescription&) const = default;
};

struct Description {
  std::uint32_t serial = 0;
  std::array<std::uint8_t, 3> firmware{};
  ChannelDescription acceleration, sound;

  bool operator==(const Description&) const = default;
};

/// Plain numbers, no heap.
struct Frame {
  Kind kind = Kind::description;
  std::uint16_t sequence = 0;     ///< +1 with each frame of this kind, wraps
  std::uint32_t device_us = 0;    ///< the sensor's clock at the block's first reading; wraps
  Description description;        ///< where kind says so
  std::uint16_t value_count = 0;  ///< of a block: readings times axes
  std::array<std::int16_t, max_values> values{};  ///< the first value_count are meant; x y z, x y z

  [[nodiscard]] std::span<const std::int16_t> counts() const {
    return std::span(values).first(value_count);
  }
  bool operator==(const Frame&) const = default;
};

/// Values in one reading of a block.
constexpr std::size_t values_per_reading(Kind kind) {
  return kind == Kind::acceleration ? axes : 1;
}

constexpr std::size_t frame_size(std::size_t body_size) {
  return head_size + body_size + tail_size;
}

/// Appends a frame: a description, or a block of 1 to max_values values, whole readings. Allocates
/// nothing when `out` has room.
void append(Bytes& out, const Frame& frame);

/// push() a chunk, then call next() until it returns false. Any chunking of a stream gives the same
/// frames. Bytes outside a frame are skipped; after a wrong check value the search goes on one byte
/// further, so that a good frame behind a damaged one is not lost. The head has a check value of
/// its own: a damaged length makes nobody wait for bytes that do not come.
class Splitter {
 public:
  /// Bytes that next() has not taken yet, at most; more than any link delivers in one chunk.
  static constexpr std::size_t capacity = 65536;

  void push(ByteView bytes) { buffer_.push(bytes); }
  bool next(Frame& frame);
  /// Forgets a frame in progress; the counters stay.
  void clear() { buffer_.clear(); }

  [[nodiscard]] std::uint64_t skipped_bytes() const { return buffer_.skipped_bytes(); }
  /// Frames with sync and version and a wrong check value of head or whole.
  [[nodiscard]] std::uint64_t crc_errors() const { return crc_errors_; }

 private:
  StreamBuffer buffer_{capacity};
  std::uint64_t crc_errors_ = 0;
};

/// For Frame::sequence.
using SequenceTracker = BasicSequenceTracker<std::uint16_t>;

}  // namespace weft::protocols::vibro
