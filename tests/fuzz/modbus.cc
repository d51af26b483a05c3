// Modbus bytes: as frames of either side in any chunking, and as a message.

#include <algorithm>
#include <vector>

#include "protocols/modbus/mbap.hpp"
#include "protocols/modbus/rtu.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz {
namespace {

using namespace weft::protocols::modbus;

std::vector<Bytes> rtu_frames(ByteView bytes, Side side, std::size_t piece) {
  RtuSplitter splitter(side, 10);
  std::vector<Bytes> out;
  for (; !bytes.empty(); bytes = bytes.subspan(std::min(piece, bytes.size()))) {
    splitter.push(bytes.first(std::min(piece, bytes.size())));
    while (const auto pdu = splitter.next()) out.emplace_back(pdu->begin(), pdu->end());
  }
  return out;
}

std::vector<Bytes> tcp_frames(ByteView bytes, std::size_t piece) {
  MbapSplitter splitter;
  std::vector<Bytes> out;
  for (; !bytes.empty(); bytes = bytes.subspan(std::min(piece, bytes.size()))) {
    splitter.push(bytes.first(std::min(piece, bytes.size())));
    while (const auto f = splitter.next()) out.emplace_back(f->pdu.begin(), f->pdu.end());
  }
  return out;
}

template <class Message>
void comes_back(const Result<Message>& message, ByteView pdu) {
  if (!message) return demand(!message.error().message.empty(), "an error says what is wrong");
  Bytes again;
  append(again, *message);
  demand(std::equal(again.begin(), again.end(), pdu.begin(), pdu.end()),
         "a message that was read is written as it was");
}

void read_message(ByteView pdu) {
  comes_back(decode_request(pdu), pdu);
  comes_back(decode_reply(pdu), pdu);
}

}  // namespace
}  // namespace weft::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace weft::fuzz;
  const weft::ByteView bytes(data, std::min<std::size_t>(size, 4096));  // what a splitter holds
  using weft::protocols::modbus::Side;
  for (const Side side : {Side::requests, Side::replies}) {
    const auto frames = rtu_frames(bytes, side, bytes.size());
    demand(frames == rtu_frames(bytes, side, 1), "any chunking gives the same frames");
    for (const weft::Bytes& pdu : frames) read_message(pdu);
  }
  const auto frames = tcp_frames(bytes, bytes.size());
  demand(frames == tcp_frames(bytes, 1), "any chunking gives the same TCP frames");
  for (const weft::Bytes& pdu : frames) read_message(pdu);
  read_message(bytes.first(std::min<std::size_t>(bytes.size(), 300)));
  return 0;
}
