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
  MbapFrame frame;
  const auto size_of = [](ByteView bytes) { return frame_size(bytes).value_or(no_frame); };
  const bool found = find(head_size, size_of, [&](ByteView whole) {
    frame.transaction = BigReader(whole).read<std::uint16_t>();
    frame.unit = whole[head_size];
    frame.pdu = whole.subspan(head_size + 1);
    return true;
  });
  return found ? std::optional(frame) : std::nullopt;
}

}  // namespace weft::protocols::modbus
