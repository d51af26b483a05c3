#include "protocols/vibro/vibro.hpp"

#include "protocols/base/result.hpp"

namespace weft::protocols::vibro {
namespace {

constexpr std::size_t value_size = 2;

/// Whether the kind exists and the body size is valid: 1 to max_values values, complete readings.
bool makes_sense(const FrameHead& head) {
  const auto kind = static_cast<Kind>(head.kind);
  if (kind == Kind::description) return head.body_size == description_size;
  const std::size_t reading = value_size * values_per_reading(kind);
  const bool known = kind == Kind::acceleration || kind == Kind::sound;
  return known && head.body_size > 0 && head.body_size % reading == 0 &&
         head.body_size <= value_size * max_values;
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

void read_frame(const FrameHead& head, ByteView body, Frame& frame) {
  frame = {};
  frame.kind = static_cast<Kind>(head.kind);
  frame.sequence = head.sequence;
  frame.device_us = head.device_us;
  LittleReader reader(body);
  if (frame.kind == Kind::description) {
    frame.description = read_description(reader);
    return;
  }
  frame.value_count = static_cast<std::uint16_t>(head.body_size / value_size);
  for (std::size_t i = 0; i < frame.value_count; ++i) frame.values[i] = reader.read<std::int16_t>();
}

FrameHead head_of(const Frame& frame) {
  const bool block = frame.kind != Kind::description;
  const std::size_t body_size = block ? value_size * frame.value_count : description_size;
  return {static_cast<std::uint8_t>(frame.kind), static_cast<std::uint16_t>(body_size),
          frame.sequence, frame.device_us};
}

}  // namespace

void append(Bytes& out, const Frame& frame) {
  const FrameHead head = head_of(frame);
  WEFT_ASSERT(makes_sense(head));
  head.append_frame(out, sync, [&](LittleWriter writer) {
    if (frame.kind == Kind::description) write_description(writer, frame.description);
    for (const std::int16_t value : frame.counts()) writer.write(value);
  });
}

bool Splitter::next(Frame& frame) {
  return find(sync, makes_sense, [&](const FrameHead& head, ByteView body) {
    read_frame(head, body, frame);
    return true;
  });
}

}  // namespace weft::protocols::vibro
