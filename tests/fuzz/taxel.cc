// The tactile array's stream, and the CPM-Finger's datagrams.

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

}  // namespace

WEFT_FUZZ_TARGET(taxel) {
  try_stream(ChunkedInput({data, size}));
  try_datagram({data, size});
  return 0;
}

}  // namespace weft::fuzz::taxel_target
