// The tactile array's stream, and the CPM-Finger's datagrams and CAN frames.

#include "protocols/taxel/taxel.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz::taxel_target {
namespace {

using namespace protocols::taxel;

void try_stream(const ChunkedInput& input) {
  Splitter whole;
  Splitter pieces;
  const auto at_once = split<Frame>(whole, input.stream, {});
  demand(at_once == split<Frame>(pieces, input.stream, input.sizes),
         "any chunking gives the same frames");
  demand(whole.damaged() == pieces.damaged(), "any chunking sees the same damage");
  demand(whole.skipped_bytes() == pieces.skipped_bytes(), "any chunking skips the same bytes");
  Bytes clean;
  for (const Frame& frame : at_once) {
    demand(frame.taxel_count >= 1 && frame.taxel_count <= max_taxels, "1 to 64 taxels");
    append(clean, frame);
  }
  demand(clean.size() + whole.skipped_bytes() <= input.stream.size(), "no byte is counted twice");
  Splitter again;
  demand(split<Frame>(again, clean, {}) == at_once, "frames that were read are written back");
  demand(again.skipped_bytes() == 0, "what is written has no garbage");
}

void try_datagram(ByteView bytes) {
  const auto counts = cpm::decode_datagram(bytes);
  demand(counts.has_value() == (bytes.size() == cpm::datagram_size), "a datagram is 32 bytes");
  if (!counts) return demand(!counts.error().what.empty(), "an error says what is wrong");
  const auto again = cpm::encode_datagram(*counts);
  demand(std::equal(again.begin(), again.end(), bytes.begin()), "a datagram is written back");
}

/// Frames of ten bytes: id, length, data. Any id, and any length that CAN allows.
void try_can(ByteView bytes) {
  constexpr std::array<std::uint16_t, 6> ids{0x405, 0x407, 0x409, 0x40B, 0x601, 0x123};
  cpm::CanAssembler assembler;
  for (; bytes.size() >= 10; bytes = bytes.subspan(10)) {
    cpm::CanFrame frame;
    frame.id = ids[bytes[0] % ids.size()];
    frame.length = static_cast<std::uint8_t>(bytes[1] % 9);
    std::copy_n(bytes.begin() + 2, 8, frame.data.begin());
    if (bytes[1] < 128) frame.length = frame.id == cpm::can_proximity_id ? 4 : 8;
    const auto scan = assembler.push(frame);
    if (!scan) continue;
    cpm::CanAssembler second;
    std::optional<cpm::Scan> again;
    for (const cpm::CanFrame& part : cpm::encode_can(*scan)) again = second.push(part);
    demand(again == scan, "a scan that was put together is written back");
  }
}

}  // namespace

WEFT_FUZZ_TARGET(taxel) {
  try_stream(ChunkedInput({data, size}));
  try_datagram({data, size});
  try_can({data, size});
  return 0;
}

}  // namespace weft::fuzz::taxel_target
