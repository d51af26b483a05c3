#pragma once
// Modbus framing, RTU on a serial line and MBAP over TCP. RTU: slave address, PDU, CRC-16 with its
// low byte first. Source: MODBUS over Serial Line 1.02, section 2.5.1; of MBAP see below.

#include <optional>

#include "protocols/base/frame_splitter.hpp"
#include "protocols/modbus/modbus.hpp"

namespace weft::protocols::modbus {

void append_rtu(Bytes& out, std::uint8_t slave, const Request& request);
void append_rtu(Bytes& out, std::uint8_t slave, const Reply& reply);

enum class Side : std::uint8_t { requests, replies };

/// push() a chunk, then call next() until it returns nothing. Frames are told by their length,
/// which follows from the function code, and their CRC, not by silence on the line, which an
/// operating system does not keep: any chunking gives the same frames. Bytes outside a frame to or
/// from `slave` are skipped; after a wrong CRC the search goes on one byte further.
///
/// Requests of functions whose length is not known here are framed too, so that they can be
/// refused: such a one ends where its CRC agrees first. Writes to all slaves (address 0) are passed
/// on. Both only where a frame has to begin: behind another one, or behind silence.
///
/// A frame that is cut short holds up what follows until its length is reached, or until a whole
/// frame lies behind it where its own length or address is not told for sure. Who knows that the
/// line has been silent calls clear().
class RtuSplitter {
 public:
  static constexpr std::size_t capacity = 4096;

  RtuSplitter(Side side, std::uint8_t slave)
      : side_(side), slave_(slave), in_step_(side == Side::requests) {}

  void push(ByteView bytes) { buffer_.push(bytes); }
  /// The PDU of the next frame, valid until the next push() or clear().
  std::optional<ByteView> next();
  /// Whether the last frame was a request to all slaves, which none answers.
  [[nodiscard]] bool to_all() const { return to_all_; }
  /// What next() has not taken.
  [[nodiscard]] ByteView rest() const { return buffer_.view(); }
  void clear() {
    buffer_.clear();
    in_step_ = side_ == Side::requests;
  }

  [[nodiscard]] std::uint64_t skipped_bytes() const { return buffer_.skipped_bytes(); }
  /// Frames with a right slave address and a plausible length, and a wrong check value.
  [[nodiscard]] std::uint64_t crc_errors() const { return crc_errors_; }

 private:
  struct Span {
    std::size_t at, end;
  };
  [[nodiscard]] std::optional<std::size_t> frame_size(ByteView bytes) const;
  [[nodiscard]] bool can_begin_here(ByteView bytes) const;
  [[nodiscard]] std::optional<Span> first_whole(ByteView bytes) const;
  ByteView take(ByteView bytes, Span frame);
  void skip(std::size_t count);

  Side side_;
  std::uint8_t slave_;
  bool in_step_;  ///< requests: nothing was skipped since the last frame or silence
  StreamBuffer buffer_{capacity};
  std::uint64_t crc_errors_ = 0;
  bool to_all_ = false;
};

// Modbus TCP framing ("MBAP"): transaction, protocol 0, length, unit, PDU; no check value, TCP has
// its own. Source: MODBUS Messaging on TCP/IP 1.0b, section 3.1.3.

inline constexpr std::uint16_t tcp_port = 502;

struct MbapFrame {
  std::uint16_t transaction = 0;  ///< a reply repeats its request's
  std::uint8_t unit = 0;          ///< slave address behind a gateway
  ByteView pdu;                   ///< valid until the splitter's next push() or clear()
};

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Request& request);
void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Reply& reply);

/// How many bytes at the front are whole frames, or no part of any.
std::size_t whole_mbap_frames(ByteView bytes);

/// As RtuSplitter. Bytes that cannot begin a frame are skipped one by one.
class MbapSplitter : public FrameSplitter {
 public:
  static constexpr std::size_t capacity = 4096;

  MbapSplitter() : FrameSplitter(capacity) {}
  std::optional<MbapFrame> next();
};

}  // namespace weft::protocols::modbus
