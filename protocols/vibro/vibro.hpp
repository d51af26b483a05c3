#pragma once
// Weft's own framing between a vibration sensor (a 3-axis accelerometer, a microphone) and the
// host. No reference gives a frame form for such a sensor. Layout: README.md of this folder.
// Little-endian.

#include <array>
#include <cstdint>
#include <span>

#include "protocols/base/frame_splitter.hpp"
#include "protocols/base/sequence.hpp"

namespace weft::protocols::vibro {

inline constexpr SyncBytes sync{0xD6, 0x6D};
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

/// Appends a frame: a description, or a block of 1 to max_values values, whole readings. Allocates
/// nothing when `out` has room.
void append(Bytes& out, const Frame& frame);

class Splitter : public FrameSplitter {
 public:
  static constexpr std::size_t capacity = 65536;  ///< more than any link delivers in one chunk

  Splitter() : FrameSplitter(capacity) {}
  bool next(Frame& frame);
};

/// For Frame::sequence.
using SequenceTracker = BasicSequenceTracker<std::uint16_t>;

}  // namespace weft::protocols::vibro
