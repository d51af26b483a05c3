#pragma once
// Weft's own framing between a dense imprint array and the host. No published array of this kind
// documents its wire format [E]. Layout: README.md of this folder. Little-endian.

#include <array>
#include <cstdint>
#include <span>

#include "protocols/base/frame_splitter.hpp"
#include "protocols/base/sequence.hpp"

namespace weft::protocols::imprint {

inline constexpr SyncBytes sync{0xB9, 0x9B};
inline constexpr std::size_t description_size = 20;
inline constexpr std::size_t window_size = 4;
inline constexpr std::size_t max_side = 128;  ///< taxels along either side
inline constexpr std::size_t max_taxels = max_side * max_side;
inline constexpr std::uint8_t highest_count = 127;  ///< 7 bits

enum class Kind : std::uint8_t {
  description = 0,  ///< identity and settings of the array; once a second
  scan = 1,         ///< the taxels of the window, row by row
  request = 2       ///< from the host: scan this window from then on
};

/// The scanned part of the array: at least one taxel, within the largest array.
struct Window {
  std::uint8_t first_row = 0, first_col = 0;
  std::uint8_t rows = 0, cols = 0;

  [[nodiscard]] std::size_t taxels() const { return std::size_t{rows} * cols; }
  bool operator==(const Window&) const = default;
};

/// 1 to 128 rows and columns, none beyond row or column 127.
constexpr bool makes_sense(const Window& window) {
  return window.rows >= 1 && window.cols >= 1 && window.first_row + window.rows <= int{max_side} &&
         window.first_col + window.cols <= int{max_side};
}

struct Description {
  std::uint32_t serial = 0;
  std::array<std::uint8_t, 3> firmware{};
  std::uint8_t rows = 0, cols = 0;  ///< of the whole array
  std::uint8_t bits = 0;            ///< bits per count
  std::uint16_t spacing_um = 0;     ///< distance of neighbouring taxels
  std::uint32_t full_scale_pa = 0;  ///< pressure of the highest count
  std::uint32_t period_us = 0;      ///< time between two scans

  bool operator==(const Description&) const = default;
};

/// Does not allocate.
struct Frame {
  Kind kind = Kind::description;
  std::uint16_t sequence = 0;   ///< +1 with each frame of this kind; wraps
  std::uint32_t device_us = 0;  ///< the array's clock at the end of the scan; wraps
  Description description;      ///< valid if kind is description
  Window window;                ///< valid for a scan and a request
  std::array<std::uint8_t, max_taxels>
      counts{};  ///< of a scan; only the first window.taxels() are valid

  [[nodiscard]] std::span<const std::uint8_t> taxels() const {
    return std::span(counts).first(kind == Kind::scan ? window.taxels() : 0);
  }
  bool operator==(const Frame& other) const;
};

/// Appends a frame. Requires a valid window and counts of at most 127. Does not allocate if `out`
/// has enough capacity.
void append(Bytes& out, const Frame& frame);

/// Frames with an invalid body count as damaged.
class Splitter : public FrameSplitter {
 public:
  static constexpr std::size_t capacity = 131072;  ///< more than any link delivers in one chunk

  Splitter() : FrameSplitter(capacity) {}
  bool next(Frame& frame);
};

/// For Frame::sequence.
using SequenceTracker = BasicSequenceTracker<std::uint16_t>;

}  // namespace weft::protocols::imprint
