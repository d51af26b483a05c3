#include "protocols/modbus/mbap.hpp"

namespace weft::protocols::modbus {
namespace {

constexpr std::size_t head_size = 6;  // transaction, protocol, length
constexpr std::size_t shortest = 2;   // unit and function code

template <class Message>
void append_frame(Bytes& out, std::uint16_t transaction, std::uint8_t unit,
                  const Message& message) {
  Bytes pdu;
  append(pdu, message);
  BigWriter writer(out);
  writer.write(transaction).write(std::uint16_t{0});
  writer.write(static_cast<std::uint16_t>(pdu.size() + 1)).write(unit).put(pdu);
}

/// Of six bytes or more; nothing when they begin no frame.
std::optional<std::size_t> frame_size(ByteView bytes) {
  BigReader reader(bytes.subspan(2));
  const auto protocol = reader.read<std::uint16_t>();
  const std::size_t length = reader.read<std::uint16_t>();
  if (protocol != 0 || length < shortest || length > longest_pdu + 1) return std::nullopt;
  return head_size + length;
}

}  // namespace

std::size_t whole_mbap_frames(ByteView bytes) {
  std::size_t at = 0;
  while (bytes.size() - at >= head_size) {
    const std::size_t size = frame_size(bytes.subspan(at)).value_or(1);
    if (bytes.size() - at < size) break;
    at += size;
  }
  return at;
}

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Request& request) {
  append_frame(out, transaction, unit, request);
}

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Reply& reply) {
  append_frame(out, transaction, unit, reply);
}

std::optional<MbapFrame> MbapSplitter::next() {
  for (ByteView bytes = buffer_.view(); bytes.size() >= head_size; bytes = buffer_.view()) {
    const std::optional<std::size_t> size = frame_size(bytes);
    if (!size) {
      buffer_.skip(1);
      continue;
    }
    if (bytes.size() < *size) return std::nullopt;
    MbapFrame frame;
    frame.transaction = BigReader(bytes).read<std::uint16_t>();
    frame.unit = bytes[head_size];
    frame.pdu = bytes.first(*size).subspan(head_size + 1);
    buffer_.consume(*size);
    return frame;
  }
  return std::nullopt;
}

}  // namespace weft::protocols::modbus
