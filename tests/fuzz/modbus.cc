// Modbus bytes: as frames of either side in any chunking, and as a message.

#include <algorithm>
#include <array>

#include "protocols/modbus/rtu.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz::modbus_target {
namespace {

using namespace weft::protocols::modbus;

/// Copies of the frames' messages: a splitter's view lasts until its next push().
struct RtuFrames {
  RtuSplitter splitter;
  void push(ByteView bytes) { splitter.push(bytes); }
  bool next(Bytes& out) {
    const auto pdu = splitter.next();
    if (pdu) out.assign(pdu->begin(), pdu->end());
    return pdu.has_value();
  }
};

struct TcpFrames {
  MbapSplitter splitter;
  void push(ByteView bytes) { splitter.push(bytes); }
  bool next(Bytes& out) {
    const auto frame = splitter.next();
    if (frame) out.assign(frame->pdu.begin(), frame->pdu.end());
    return frame.has_value();
  }
};

template <class Message>
void comes_back(const Result<Message>& message, ByteView pdu) {
  if (!message) return demand(!message.error().what.empty(), "an error says what is wrong");
  Bytes again;
  append(again, *message);
  demand(std::equal(again.begin(), again.end(), pdu.begin(), pdu.end()),
         "a message that was read is written as it was");
}

void read_message(ByteView pdu) {
  comes_back(decode_request(pdu), pdu);
  comes_back(decode_reply(pdu), pdu);
}

/// At once, in pieces chosen by the input, and byte by byte.
template <class Frames>
void try_stream(ByteView bytes, ByteView sizes, const Frames& fresh) {
  Frames whole = fresh;
  const auto at_once = split<Bytes>(whole, bytes, {});
  constexpr std::array<std::uint8_t, 1> single{1};
  for (const ByteView some : {sizes, ByteView(single)}) {
    Frames pieces = fresh;
    demand(at_once == split<Bytes>(pieces, bytes, some), "any chunking gives the same frames");
    demand(whole.splitter.skipped_bytes() == pieces.splitter.skipped_bytes(),
           "any chunking skips the same bytes");
  }
  for (const Bytes& pdu : at_once) read_message(pdu);
}

}  // namespace

WEFT_FUZZ_TARGET(modbus) {
  using namespace weft::fuzz;
  using namespace weft::protocols::modbus;
  const ChunkedInput input({data, size});
  const auto bytes = input.stream.first(std::min(input.stream.size(), RtuSplitter::capacity));
  for (const Side side : {Side::requests, Side::replies})
    try_stream(bytes, input.sizes, RtuFrames{RtuSplitter(side, 10)});
  try_stream(bytes, input.sizes, TcpFrames{});
  read_message(bytes.first(std::min<std::size_t>(bytes.size(), 300)));
  return 0;
}

}  // namespace weft::fuzz::modbus_target
