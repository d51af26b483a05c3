// ATI Net F/T: requests, records, datagrams, the command port.

#include <algorithm>

#include "protocols/rdt/rdt.hpp"
#include "protocols/rdt/tcp_command.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::rdt_target {
namespace {

using namespace protocols::rdt;

bool same(ByteView a, ByteView b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

void try_request(ByteView bytes) {
  const Result<Request> request = decode_request(bytes);
  if (!request) return demand(!request.error().what.empty(), "an error says what is wrong");
  demand(same(encode(*request), bytes), "a request that was read is written back");
}

void try_datagram(ByteView bytes) {
  const Result<std::size_t> count = record_count(bytes);
  if (!count) return demand(!count.error().what.empty(), "an error says what is wrong");
  demand(*count >= 1 && *count <= max_records_per_datagram, "a datagram holds 1 to 40 records");
  demand(*count * record_size == bytes.size(), "records fill the datagram");
  Bytes again;
  for (std::size_t i = 0; i < *count; ++i) {
    const Result<Record> record = decode_record(bytes.subspan(i * record_size, record_size));
    demand(record.has_value(), "every record of a counted datagram can be read");
    append(again, *record);
  }
  demand(same(again, bytes), "records that were read are written back");
}

/// Unused bytes of a request are written as zeros, so only the second reading must be equal.
void try_command(ByteView bytes) {
  const Result<CommandRequest> request = decode_command(bytes);
  if (!request) return demand(!request.error().what.empty(), "an error says what is wrong");
  Bytes again;
  append(again, *request);
  demand(again.size() == command_size, "a request to the command port is 20 bytes");
  const Result<CommandRequest> read_again = decode_command(again);
  demand(read_again.has_value() && *read_again == *request,
         "a command that was read is written back");
}

template <class Reply>
void try_reply(ByteView bytes, const Result<Reply>& reply) {
  if (!reply) return demand(!reply.error().what.empty(), "an error says what is wrong");
  Bytes again;
  append(again, *reply);
  demand(same(again, bytes), "a reply that was read is written back");
}

}  // namespace

WEFT_FUZZ_TARGET(rdt) {
  const weft::ByteView input(data, size);
  try_request(input);
  try_datagram(input);
  try_command(input);
  try_reply(input, weft::protocols::rdt::decode_ft_reply(input));
  try_reply(input, weft::protocols::rdt::decode_calibration_reply(input));
  try_reply(input, weft::protocols::rdt::decode_write_reply(input));
  const bool one = weft::protocols::rdt::decode_record(input).has_value();
  demand(one == (size == weft::protocols::rdt::record_size), "a record is 36 bytes");
  return 0;
}

}  // namespace weft::fuzz::rdt_target
