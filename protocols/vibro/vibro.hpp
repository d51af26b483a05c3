#pragma once
// Weft's own framing between a vibration sensor (3-axis accelerometer, microphone) and the host. No
// reference documents a frame format for such a sensor. Layout: README.md of this folder.
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
  description = 0,   ///< identity and channels of the sensor; once a second
  acceleration = 1,  ///< a block of readings x, y, z
  sound = 2          ///< a block of readings of the microphone
};

/// One channel, as described by the sensor. One count is range / full_scale_counts.
struct ChannelDescription {
  std::uint32_t rate_mhz = 0;     ///< readings per second [mHz]; 0: no such channel
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

/// Does not allocate.
struct Frame {
  Kind kind = Kind::description;
  std::uint16_t sequence = 0;     ///< +1 with each frame of this kind; wraps
  std::uint32_t device_us = 0;    ///< the sensor's clock at the block's first reading; wraps
  Description description;        ///< valid if kind is description
  std::uint16_t value_count = 0;  ///< of a block: readings times axes
  std::array<std::int16_t, max_values>
      values{};  ///< only the first value_count are valid; x y z, x y z

  [[nodiscard]] std::span<const std::int16_t> counts() const {
    return std::span(values).first(value_count);
  }
  bool operator==(const Frame&) const = default;
};

/// Values in one reading of a block.
constexpr std::size_t values_per_reading(Kind kind) {
  return kind == Kind::acceleration ? axes : 1;
}

/// Appends a frame: a description, or a block of complete readings with 1 to max_values values.
/// Does not allocate if `out` has enough capacity.
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
