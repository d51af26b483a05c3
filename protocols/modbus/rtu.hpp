#pragma once
// Modbus framing: RTU on a serial line and MBAP over TCP. RTU: slave address, PDU, CRC-16 with its
// low byte first. Source: MODBUS over Serial Line 1.02, section 2.5.1; for MBAP see below.

#include <optional>

#include "protocols/base/frame_splitter.hpp"
#include "protocols/modbus/modbus.hpp"

namespace weft::protocols::modbus {

void append_rtu(Bytes& out, std::uint8_t slave, const Request& request);
void append_rtu(Bytes& out, std::uint8_t slave, const Reply& reply);

enum class Side : std::uint8_t { requests, replies };

/// push() a chunk, then call next() until it returns nullopt. Frames are delimited by their length,
/// which follows from the function code, and by their CRC. Silence on the line is not used, because
/// an operating system does not preserve it. So the chunking does not affect the frames. Bytes
/// outside a frame to or from `slave` are skipped. After a wrong CRC the search continues one byte
/// later.
///
/// Requests of functions with unknown length are framed too, so that they can be refused: they end
/// at the first CRC that agrees. Writes to all slaves (address 0) are returned. Both are accepted
/// only where a frame must begin: after another frame or after silence.
///
/// A truncated frame delays the following bytes until its length is reached. If its length or
/// address is uncertain, the delay also ends when a complete frame lies after it. A caller that
/// detects silence on the line calls clear().
class RtuSplitter {
 public:
  static constexpr std::size_t capacity = 4096;

  RtuSplitter(Side side, std::uint8_t slave)
      : side_(side), slave_(slave), in_step_(side == Side::requests) {}

  void push(ByteView bytes) { buffer_.push(bytes); }
  /// The PDU of the next frame, valid until the next push() or clear().
  std::optional<ByteView> next();
  /// Whether the last frame was a request to all slaves, which no slave answers.
  [[nodiscard]] bool to_all() const { return to_all_; }
  /// Bytes that next() has not consumed.
  [[nodiscard]] ByteView rest() const { return buffer_.view(); }
  void clear() {
    buffer_.clear();
    in_step_ = side_ == Side::requests;
  }

  [[nodiscard]] std::uint64_t skipped_bytes() const { return buffer_.skipped_bytes(); }
  /// Frames with the right slave address, a plausible length and a wrong check value.
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
  bool in_step_;  ///< requests: no byte skipped since the last frame or silence
  StreamBuffer buffer_{capacity};
  std::uint64_t crc_errors_ = 0;
  bool to_all_ = false;
};

// Modbus TCP framing ("MBAP"): transaction, protocol 0, length, unit, PDU. It has no check value
// because TCP has one. Source: MODBUS Messaging on TCP/IP 1.0b, section 3.1.3.

inline constexpr std::uint16_t tcp_port = 502;

struct MbapFrame {
  std::uint16_t transaction = 0;  ///< a reply repeats that of its request
  std::uint8_t unit = 0;          ///< slave address behind a gateway
  ByteView pdu;                   ///< valid until the splitter's next push() or clear()
};

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Request& request);
void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Reply& reply);

/// Number of bytes at the front that are complete frames or belong to no frame.
std::size_t whole_mbap_frames(ByteView bytes);

/// As RtuSplitter. Bytes that cannot begin a frame are skipped one by one.
class MbapSplitter : public FrameSplitter {
 public:
  static constexpr std::size_t capacity = 4096;

  MbapSplitter() : FrameSplitter(capacity) {}
  std::optional<MbapFrame> next();
};

}  // namespace weft::protocols::modbus
