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

}  // namespace

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Request& request) {
  append_frame(out, transaction, unit, request);
}

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Reply& reply) {
  append_frame(out, transaction, unit, reply);
}

std::optional<MbapFrame> MbapSplitter::next() {
  for (ByteView bytes = buffer_.view(); bytes.size() >= head_size; bytes = buffer_.view()) {
    BigReader reader(bytes);
    MbapFrame frame;
    frame.transaction = reader.read<std::uint16_t>();
    const auto protocol = reader.read<std::uint16_t>();
    const std::size_t length = reader.read<std::uint16_t>();
    if (protocol != 0 || length < shortest || length > longest_pdu + 1) {
      buffer_.consume(1);
      ++skipped_bytes_;
      continue;
    }
    if (reader.remaining() < length) return std::nullopt;
    frame.unit = reader.read<std::uint8_t>();
    frame.pdu = reader.take(length - 1);
    buffer_.consume(head_size + length);
    return frame;
  }
  return std::nullopt;
}

}  // namespace weft::protocols::modbus
