#include "protocols/rdt/tcp_command.hpp"

#include <numbers>
#include <string>

namespace weft::protocols::rdt {
namespace {

constexpr std::uint16_t first_value = 0x1234;
constexpr std::size_t mask_at = 16;
constexpr std::uint16_t bias_bit = 1, clear_latch_bit = 2;

struct Writer {
  Bytes* out;

  void operator()(const ReadFt& r) const {
    out->resize(out->size() + mask_at - 1);
    const int bits = (r.bias ? bias_bit : 0) | (r.clear_latch ? clear_latch_bit : 0);
    BigWriter(*out).write(r.condition_mask).write(static_cast<std::uint16_t>(bits));
  }
  void operator()(const ReadCalibration&) const { out->resize(out->size() + command_size - 1); }
  void operator()(const WriteTransform& w) const {
    BigWriter writer(*out);
    writer.write(w.distance_unit).write(w.angle_unit);
    for (const std::int16_t value : w.hundredths) writer.write(value);
    constexpr std::size_t reserved = 5;
    out->resize(out->size() + reserved);
  }
  void operator()(const WriteCondition& w) const {
    BigWriter writer(*out);
    writer.write(w.index).write(w.axis).write(w.output_code).write(w.comparison);
    writer.write(w.compared_with);
    constexpr std::size_t reserved = 13;
    out->resize(out->size() + reserved);
  }
};

ReadFt read_ft(ByteView bytes) {
  BigReader reader(bytes.subspan(mask_at));
  ReadFt read;
  read.condition_mask = reader.read<std::uint16_t>();
  const auto bits = reader.read<std::uint16_t>();
  read.bias = (bits & bias_bit) != 0;
  read.clear_latch = (bits & clear_latch_bit) != 0;
  return read;
}

WriteTransform write_transform(ByteView bytes) {
  BigReader reader(bytes.subspan(1));
  WriteTransform write;
  write.distance_unit = reader.read<std::uint8_t>();
  write.angle_unit = reader.read<std::uint8_t>();
  for (std::int16_t& value : write.hundredths) value = reader.read<std::int16_t>();
  return write;
}

WriteCondition write_condition(ByteView bytes) {
  BigReader reader(bytes.subspan(1));
  WriteCondition write;
  write.index = reader.read<std::uint8_t>();
  write.axis = reader.read<std::uint8_t>();
  write.output_code = reader.read<std::uint8_t>();
  write.comparison = reader.read<std::int8_t>();
  write.compared_with = reader.read<std::int16_t>();
  return write;
}

/// Reader positioned after the first word of a reply. Errors: parse.
Result<BigReader> reply_reader(ByteView bytes, std::size_t size) {
  if (bytes.size() != size)
    return fail({.code = Errc::parse,
                 .what = "reply of the command port has the wrong length",
                 .expected = std::to_string(size) + " bytes",
                 .got = std::to_string(bytes.size()) + " bytes"});
  BigReader reader(bytes);
  const auto word = reader.read<std::uint16_t>();
  if (word != first_value)
    return fail({.code = Errc::parse,
                 .what = "reply of the command port does not begin with 0x1234",
                 .expected = "4660",
                 .got = std::to_string(word)});
  return reader;
}

}  // namespace

void append(Bytes& out, const CommandRequest& request) {
  out.push_back(static_cast<std::uint8_t>(request.index()));
  std::visit(Writer{&out}, request);
}

Result<CommandRequest> decode_command(ByteView bytes) {
  if (bytes.size() != command_size)
    return fail({.code = Errc::parse,
                 .what = "request to the command port has the wrong length",
                 .expected = "20 bytes",
                 .got = std::to_string(bytes.size()) + " bytes"});
  switch (static_cast<TcpCommand>(bytes[0])) {
    case TcpCommand::read_ft:
      return read_ft(bytes);
    case TcpCommand::read_calibration:
      return ReadCalibration{};
    case TcpCommand::write_transform:
      return write_transform(bytes);
    case TcpCommand::write_condition:
      return write_condition(bytes);
  }
  return fail({.code = Errc::unsupported,
               .what = "command of the command port unknown",
               .expected = "0 to 3",
               .got = std::to_string(bytes[0])});
}

void append(Bytes& out, const FtReply& reply) {
  BigWriter writer(out);
  writer.write(first_value).write(reply.status);
  for (const std::int16_t counts : reply.counts) writer.write(counts);
}

void append(Bytes& out, const CalibrationReply& reply) {
  BigWriter writer(out);
  writer.write(first_value).write(reply.force_unit).write(reply.torque_unit);
  writer.write(reply.counts_per_force).write(reply.counts_per_torque);
  for (const std::uint16_t factor : reply.scale) writer.write(factor);
}

void append(Bytes& out, const WriteReply& reply) {
  BigWriter(out)
      .write(first_value)
      .write(static_cast<std::uint8_t>(reply.command))
      .write(reply.error);
}

Result<FtReply> decode_ft_reply(ByteView bytes) {
  auto reader = reply_reader(bytes, ft_reply_size);
  if (!reader) return pass(reader.error());
  FtReply reply;
  reply.status = reader->read<std::uint16_t>();
  for (std::int16_t& counts : reply.counts) counts = reader->read<std::int16_t>();
  return reply;
}

Result<CalibrationReply> decode_calibration_reply(ByteView bytes) {
  auto reader = reply_reader(bytes, calibration_reply_size);
  if (!reader) return pass(reader.error());
  CalibrationReply reply;
  reply.force_unit = reader->read<std::uint8_t>();
  reply.torque_unit = reader->read<std::uint8_t>();
  reply.counts_per_force = reader->read<std::uint32_t>();
  reply.counts_per_torque = reader->read<std::uint32_t>();
  for (std::uint16_t& factor : reply.scale) factor = reader->read<std::uint16_t>();
  return reply;
}

Result<WriteReply> decode_write_reply(ByteView bytes) {
  auto reader = reply_reader(bytes, write_reply_size);
  if (!reader) return pass(reader.error());
  WriteReply reply;
  reply.command = static_cast<TcpCommand>(reader->read<std::uint8_t>());
  reply.error = reader->read<std::uint8_t>();
  return reply;
}

Result<double> metres_per(std::uint8_t distance_unit) {
  constexpr std::array metres{0.0254, 0.3048, 0.001, 0.01, 1.0};
  if (distance_unit >= 1 && distance_unit <= metres.size()) return metres[distance_unit - 1U];
  return fail({.code = Errc::unsupported,
               .what = "unit of distance unknown",
               .expected = "1 to 5",
               .got = std::to_string(distance_unit)});
}

Result<double> radians_per(std::uint8_t angle_unit) {
  if (angle_unit == 1) return std::numbers::pi / 180;
  if (angle_unit == 2) return 1.0;
  return fail({.code = Errc::unsupported,
               .what = "unit of angle unknown",
               .expected = "1 or 2",
               .got = std::to_string(angle_unit)});
}

}  // namespace weft::protocols::rdt
