#include "protocols/modbus/rtu.hpp"

#include <algorithm>

#include "protocols/base/bytes.hpp"

namespace weft::protocols::modbus {
namespace {

constexpr std::size_t crc_size = 2;
constexpr std::size_t no_frame = 0;
constexpr std::size_t shortest_frame = 4;
constexpr std::size_t longest_frame = 256;  // MODBUS over Serial Line 1.02, 2.3
constexpr std::uint8_t all_slaves = 0;

template <class Message>
void append_frame(Bytes& out, std::uint8_t slave, const Message& message) {
  const std::size_t start = out.size();
  out.push_back(slave);
  append(out, message);
  LittleWriter(out).write(crc16_modbus(ByteView(out).subspan(start)));
}

/// Frame size: `head` bytes, the number of bytes given by the byte at `at`, and the CRC. nullopt
/// before that byte has arrived.
std::optional<std::size_t> counted(ByteView bytes, std::size_t head, std::size_t at) {
  if (bytes.size() <= at) return std::nullopt;
  return head + bytes[at] + crc_size;
}

// Standard functions that no device here implements are framed too: the answer is an exception.
// no_frame: unknown length.
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
    case 0x14:
    case 0x15:
      return counted(bytes, 3, 2);
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

void RtuSplitter::skip(std::size_t count) {
  buffer_.skip(count);
  in_step_ = false;
}

ByteView RtuSplitter::take(ByteView bytes, Span frame) {
  skip(frame.at);
  buffer_.consume(frame.end - frame.at);
  in_step_ = side_ == Side::requests;
  to_all_ = bytes[frame.at] == all_slaves;
  return bytes.subspan(frame.at + 1, frame.end - frame.at - 1 - crc_size);
}

std::optional<std::size_t> RtuSplitter::frame_size(ByteView bytes) const {
  if (bytes[0] != slave_) return no_frame;
  if (bytes.size() < 2) return std::nullopt;
  return side_ == Side::requests ? request_size(bytes) : reply_size(bytes);
}

/// For bytes that begin no frame of known length to this slave: whether a request of unknown
/// length, delimited by its CRC only, may begin here.
bool RtuSplitter::can_begin_here(ByteView bytes) const {
  if (!in_step_ || bytes.size() < 2) return false;
  if (bytes[0] == all_slaves && slave_ != all_slaves) return bytes[1] == 0x06 || bytes[1] == 0x10;
  return bytes[0] == slave_ && bytes[1] > 0 && bytes[1] < 0x80;
}

/// The frame that ends first: the one that may begin here or one after it. So the chunking does not
/// affect the frames.
std::optional<RtuSplitter::Span> RtuSplitter::first_whole(ByteView bytes) const {
  std::optional<Span> found;
  bytes = bytes.first(std::min(bytes.size(), longest_frame));
  std::uint16_t crc = crc16_modbus({});
  for (std::size_t end = 1; end <= bytes.size() && !found; ++end) {
    crc = crc16_modbus(bytes.subspan(end - 1, 1), crc);
    // the CRC over a frame with its check value is zero
    const bool right_size = bytes[0] == slave_ || request_size(bytes) == end;
    if (end >= shortest_frame && crc == 0 && right_size) found = Span{0, end};
  }
  for (std::size_t at = 1; at + shortest_frame <= bytes.size(); ++at) {
    const std::optional<std::size_t> size = frame_size(bytes.subspan(at));
    if (!size || size == no_frame || at + *size > bytes.size()) continue;
    if (found && found->end <= at + *size) continue;
    if (crc_agrees(bytes.subspan(at, *size))) found = Span{at, at + *size};
  }
  return found;
}

std::optional<ByteView> RtuSplitter::next() {
  for (ByteView bytes = buffer_.view(); !bytes.empty(); bytes = buffer_.view()) {
    const std::optional<std::size_t> size = frame_size(bytes);
    if (size == no_frame && can_begin_here(bytes)) {
      if (const std::optional<Span> frame = first_whole(bytes)) return take(bytes, *frame);
      if (bytes.size() < longest_frame) return std::nullopt;
    }
    if (size == no_frame) {
      if (bytes.size() < 2 && bytes[0] == all_slaves && in_step_) return std::nullopt;
      skip(1);
      continue;
    }
    if (!size || bytes.size() < *size) return std::nullopt;
    if (crc_agrees(bytes.first(*size))) return take(bytes, {0, *size});
    ++crc_errors_;
    skip(1);
  }
  return std::nullopt;
}

namespace {

constexpr std::size_t mbap_head_size = 6;   // transaction, protocol, length
constexpr std::size_t shortest_length = 2;  // unit and function code

template <class Message>
void append_tcp_frame(Bytes& out, std::uint16_t transaction, std::uint8_t unit,
                      const Message& message) {
  Bytes pdu;
  append(pdu, message);
  BigWriter writer(out);
  writer.write(transaction).write(std::uint16_t{0});
  writer.write(static_cast<std::uint16_t>(pdu.size() + 1)).write(unit).put(pdu);
}

/// Frame size from six or more bytes; nullopt if no frame begins there.
std::optional<std::size_t> mbap_size(ByteView bytes) {
  BigReader reader(bytes.subspan(2));
  const auto protocol = reader.read<std::uint16_t>();
  const std::size_t length = reader.read<std::uint16_t>();
  if (protocol != 0 || length < shortest_length || length > longest_pdu + 1) return std::nullopt;
  return mbap_head_size + length;
}

}  // namespace

std::size_t whole_mbap_frames(ByteView bytes) {
  std::size_t at = 0;
  while (bytes.size() - at >= mbap_head_size) {
    const std::size_t size = mbap_size(bytes.subspan(at)).value_or(1);
    if (bytes.size() - at < size) break;
    at += size;
  }
  return at;
}

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Request& request) {
  append_tcp_frame(out, transaction, unit, request);
}

void append_mbap(Bytes& out, std::uint16_t transaction, std::uint8_t unit, const Reply& reply) {
  append_tcp_frame(out, transaction, unit, reply);
}

std::optional<MbapFrame> MbapSplitter::next() {
  MbapFrame frame;
  const auto size_of = [](ByteView bytes) { return mbap_size(bytes).value_or(no_frame); };
  const bool found = find(mbap_head_size, size_of, [&](ByteView whole) {
    frame.transaction = BigReader(whole).read<std::uint16_t>();
    frame.unit = whole[mbap_head_size];
    frame.pdu = whole.subspan(mbap_head_size + 1);
    return true;
  });
  return found ? std::optional(frame) : std::nullopt;
}

}  // namespace weft::protocols::modbus
