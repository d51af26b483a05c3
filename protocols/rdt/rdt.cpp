#include "protocols/rdt/rdt.hpp"

#include <string>

namespace weft::protocols::rdt {
namespace {
constexpr std::uint16_t request_magic = 0x1234;
}

std::array<std::uint8_t, request_size> encode(const Request& request) {
  const auto command = static_cast<std::uint16_t>(request.command);
  const std::uint32_t count = request.sample_count;
  return {request_magic >> 8,
          request_magic & 0xFF,
          static_cast<std::uint8_t>(command >> 8),
          static_cast<std::uint8_t>(command),
          static_cast<std::uint8_t>(count >> 24),
          static_cast<std::uint8_t>(count >> 16),
          static_cast<std::uint8_t>(count >> 8),
          static_cast<std::uint8_t>(count)};
}

Result<Request> decode_request(ByteView datagram) {
  if (datagram.size() != request_size)
    return fail({.code = Errc::parse,
                 .what = "RDT request has the wrong length",
                 .expected = "8 bytes",
                 .got = std::to_string(datagram.size()) + " bytes"});
  BigReader reader(datagram);
  const auto magic = reader.read<std::uint16_t>();
  if (magic != request_magic)
    return fail({.code = Errc::parse,
                 .what = "RDT request does not begin with 0x1234",
                 .expected = "4660",
                 .got = std::to_string(magic)});
  Request request;
  request.command = static_cast<RequestCommand>(reader.read<std::uint16_t>());
  request.sample_count = reader.read<std::uint32_t>();
  return request;
}

void append(Bytes& out, const Record& record) {
  BigWriter writer(out);
  writer.write(record.rdt_sequence).write(record.ft_sequence).write(record.status);
  for (const std::int32_t counts : record.force_counts) writer.write(counts);
  for (const std::int32_t counts : record.torque_counts) writer.write(counts);
}

Result<Record> decode_record(ByteView bytes) {
  if (bytes.size() != record_size)
    return fail({.code = Errc::parse,
                 .what = "RDT record has the wrong length",
                 .expected = "36 bytes",
                 .got = std::to_string(bytes.size()) + " bytes"});
  BigReader reader(bytes);
  Record record;
  record.rdt_sequence = reader.read<std::uint32_t>();
  record.ft_sequence = reader.read<std::uint32_t>();
  record.status = reader.read<std::uint32_t>();
  for (std::int32_t& counts : record.force_counts) counts = reader.read<std::int32_t>();
  for (std::int32_t& counts : record.torque_counts) counts = reader.read<std::int32_t>();
  return record;
}

Result<std::size_t> record_count(ByteView datagram) {
  const std::size_t count = datagram.size() / record_size;
  if (datagram.size() % record_size != 0 || count == 0 || count > max_records_per_datagram)
    return fail({.code = Errc::parse,
                 .what = "RDT datagram is not a whole number of records",
                 .expected = "1 to 40 times 36 bytes",
                 .got = std::to_string(datagram.size()) + " bytes"});
  return count;
}

}  // namespace weft::protocols::rdt
