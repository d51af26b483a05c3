#pragma once
// Cuts a byte stream into APT messages. The protocol has neither a sync byte nor a checksum, so a
// header is believed only when it is plausible.

#include <cstdint>

#include "protocols/apt/message.hpp"
#include "protocols/base/frame_splitter.hpp"

namespace weft::protocols::apt {

/// Whose end of the line it is.
enum class LineEnd : std::uint8_t {
  host,       ///< believes the lengths of APT16 alone, which gets it over noise
  controller  ///< hears hosts, and believes what their headers say: newer issues have longer bodies
};

/// A header is plausible when exactly one side of its route is a known unit (for a
/// controller: its destination), its length is 1 to 255 and, for ids of the protocol, form and
/// length are believed. Anything else is skipped byte by byte. Unknown ids with a plausible route
/// are passed on.
class Splitter : public FrameSplitter {
 public:
  /// Bytes that next() has not taken yet, at most; more than any link delivers in one chunk.
  static constexpr std::size_t capacity = 65536;

  explicit Splitter(LineEnd line_end = LineEnd::host)
      : FrameSplitter(capacity), line_end_(line_end) {}

  /// Overwrites `message` with the next whole one; reuses the room of its data.
  bool next(Message& message);

 private:
  [[nodiscard]] std::size_t plausible_length(ByteView header) const;

  LineEnd line_end_;
};

}  // namespace weft::protocols::apt
