#include "protocols/modbus/rtu.hpp"

#include "protocols/base/crc.hpp"

namespace weft::protocols::modbus {
namespace {

constexpr std::size_t crc_size = 2;
constexpr std::size_t no_frame = 0;

template <class Message>
void append_frame(Bytes& out, std::uint8_t slave, const Message& message) {
  const std::size_t start = out.size();
  out.push_back(slave);
  append(out, message);
  LittleWriter(out).write(crc16_modbus(ByteView(out).subspan(start)));
}

/// Head bytes, then as many as the byte at `at` says; unknown before that byte is there.
std::optional<std::size_t> counted(ByteView bytes, std::size_t head, std::size_t at) {
  if (bytes.size() <= at) return std::nullopt;
  return head + bytes[at] + crc_size;
}

// Standard functions that nobody here serves are framed too: they are answered with an exception.
std::optional<std::size_t> request_size(ByteView bytes) {
  switch (bytes[1]) {
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x04:
    case 0x05:
    case 0x06:
    case 0x08:
      return 8;
    case 0x07:
    case 0x0B:
    case 0x0C:
    case 0x11:
      return 4;
    case 0x0F:
    case 0x10:
      return counted(bytes, 7, 6);
    case 0x16:
      return 10;
    case 0x17:
      return counted(bytes, 11, 10);
    case 0x18:
      return 6;
    case 0x46:
    case 0x6A:
      return 5;
    default:
      return no_frame;
  }
}

std::optional<std::size_t> reply_size(ByteView bytes) {
  if ((bytes[1] & 0x80) != 0) return 5;
  switch (bytes[1]) {
    case 0x03:
    case 0x04:
      return counted(bytes, 3, 2);
    case 0x06:
    case 0x10:
      return 8;
    case 0x46:
    case 0x6A:
      return 5;
    default:
      return no_frame;
  }
}

bool crc_agrees(ByteView frame) {
  return LittleReader(frame.last(crc_size)).read<std::uint16_t>() ==
         crc16_modbus(frame.first(frame.size() - crc_size));
}

}  // namespace

void append_rtu(Bytes& out, std::uint8_t slave, const Request& request) {
  append_frame(out, slave, request);
}

void append_rtu(Bytes& out, std::uint8_t slave, const Reply& reply) {
  append_frame(out, slave, reply);
}

void RtuSplitter::skip_byte() {
  buffer_.consume(1);
  ++skipped_bytes_;
}

std::optional<std::size_t> RtuSplitter::frame_size(ByteView bytes) const {
  if (bytes[0] != slave_) return no_frame;
  if (bytes.size() < 2) return std::nullopt;
  return side_ == Side::requests ? request_size(bytes) : reply_size(bytes);
}

std::optional<ByteView> RtuSplitter::next() {
  for (ByteView bytes = buffer_.view(); !bytes.empty(); bytes = buffer_.view()) {
    const std::optional<std::size_t> size = frame_size(bytes);
    if (size == no_frame) {
      skip_byte();
      continue;
    }
    if (!size || bytes.size() < *size) return std::nullopt;
    if (!crc_agrees(bytes.first(*size))) {
      ++crc_errors_;
      skip_byte();
      continue;
    }
    buffer_.consume(*size);
    return bytes.subspan(1, *size - 1 - crc_size);
  }
  return std::nullopt;
}

}  // namespace weft::protocols::modbus
