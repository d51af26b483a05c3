#pragma once
// Modbus TCP framing ("MBAP"): transaction, protocol 0, length, unit, PDU; no check value, TCP has
// its own. Source: MODBUS Messaging on TCP/IP 1.0b, section 3.1.3.

#include <optional>

#include "protocols/base/frame_splitter.hpp"
#include "protocols/modbus/modbus.hpp"

namespace weft::protocols::modbus {

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
