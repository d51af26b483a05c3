#include "protocols/vibro/vibro.hpp"

#include "protocols/base/crc.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::vibro {
namespace {

constexpr std::size_t head_check_at = 12;
constexpr std::size_t value_size = 2;

struct Head {
  Kind kind;
  std::size_t body_size;
};

std::uint16_t u16_at(ByteView bytes, std::size_t at) {
  return LittleReader(bytes.subspan(at, 2)).read<std::uint16_t>();
}

bool starts_a_frame(ByteView bytes) {
  return bytes[0] == sync[0] && bytes[1] == sync[1] && bytes[2] == version;
}

bool head_agrees(ByteView head) {
  return u16_at(head, head_check_at) == crc16_ccitt(head.subspan(2, head_check_at - 2));
}

/// A kind that exists and the body that it has: whole readings, not none, not too many.
bool makes_sense(const Head& head) {
  if (head.kind == Kind::description) return head.body_size == description_size;
  const std::size_t reading = value_size * values_per_reading(head.kind);
  const bool known = head.kind == Kind::acceleration || head.kind == Kind::sound;
  return known && head.body_size > 0 && head.body_size % reading == 0 &&
         head.body_size <= value_size * max_values;
}

bool tail_agrees(ByteView frame) {
  const ByteView covered = frame.subspan(sync.size(), frame.size() - sync.size() - tail_size);
  return LittleReader(frame.last(tail_size)).read<std::uint32_t>() == crc32(covered);
}

ChannelDescription read_channel(LittleReader& reader) {
  ChannelDescription channel;
  channel.rate_mhz = reader.read<std::uint32_t>();
  channel.range_micro = reader.read<std::uint32_t>();
  channel.full_scale_counts = reader.read<std::uint16_t>();
  channel.block_readings = reader.read<std::uint16_t>();
  return channel;
}

void write_channel(LittleWriter& writer, const ChannelDescription& channel) {
  writer.write(channel.rate_mhz).write(channel.range_micro);
  writer.write(channel.full_scale_counts).write(channel.block_readings);
}

Description read_description(LittleReader& reader) {
  Description description;
  description.serial = reader.read<std::uint32_t>();
  for (std::uint8_t& part : description.firmware) part = reader.read<std::uint8_t>();
  reader.take(1);
  description.acceleration = read_channel(reader);
  description.sound = read_channel(reader);
  return description;
}

void write_description(LittleWriter& writer, const Description& description) {
  writer.write(description.serial).put(description.firmware).write(std::uint8_t{0});
  write_channel(writer, description.acceleration);
  write_channel(writer, description.sound);
}

void read_frame(ByteView bytes, const Head& head, Frame& frame) {
  frame = {};
  LittleReader reader(bytes.subspan(6));
  frame.kind = head.kind;
  frame.sequence = reader.read<std::uint16_t>();
  frame.device_us = reader.read<std::uint32_t>();
  reader.take(2);
  if (head.kind == Kind::description) {
    frame.description = read_description(reader);
    return;
  }
  frame.value_count = static_cast<std::uint16_t>(head.body_size / value_size);
  for (std::size_t i = 0; i < frame.value_count; ++i) frame.values[i] = reader.read<std::int16_t>();
}

std::size_t body_size(const Frame& frame) {
  return frame.kind == Kind::description ? description_size : value_size * frame.value_count;
}

}  // namespace

void append(Bytes& out, const Frame& frame) {
  const Head head{frame.kind, body_size(frame)};
  WEFT_ASSERT(makes_sense(head));
  const std::size_t start = out.size();
  const auto since_sync = [&] { return ByteView(out).subspan(start + sync.size()); };
  LittleWriter writer(out);
  writer.put(sync).write(version).write(static_cast<std::uint8_t>(frame.kind));
  writer.write(static_cast<std::uint16_t>(head.body_size));
  writer.write(frame.sequence).write(frame.device_us);
  writer.write(crc16_ccitt(since_sync()));
  if (frame.kind == Kind::description) write_description(writer, frame.description);
  for (const std::int16_t value : frame.counts()) writer.write(value);
  writer.write(crc32(since_sync()));
}

bool Splitter::next(Frame& frame) {
  for (ByteView bytes = buffer_.view(); bytes.size() >= head_size; bytes = buffer_.view()) {
    if (!starts_a_frame(bytes)) {
      buffer_.skip(1);
      continue;
    }
    const Head head{static_cast<Kind>(bytes[3]), u16_at(bytes, 4)};
    if (!head_agrees(bytes.first(head_size)) || !makes_sense(head)) {
      ++crc_errors_;
      buffer_.skip(1);
      continue;
    }
    const std::size_t size = frame_size(head.body_size);
    if (bytes.size() < size) return false;
    if (!tail_agrees(bytes.first(size))) {
      ++crc_errors_;
      buffer_.skip(1);
      continue;
    }
    read_frame(bytes.first(size), head, frame);
    buffer_.consume(size);
    return true;
  }
  return false;
}

}  // namespace weft::protocols::vibro
