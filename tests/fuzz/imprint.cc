// The imprint array's stream, and what a host asks of it.

#include "protocols/imprint/imprint.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz {
namespace {

using namespace protocols::imprint;

void look_at(const Frame& frame) {
  if (frame.kind == Kind::description) return demand(frame.taxels().empty(), "it has no taxels");
  demand(makes_sense(frame.window), "a window within the largest array");
  for (const std::uint8_t count : frame.taxels()) demand(count <= highest_count, "seven bits");
}

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
    look_at(frame);
    append(clean, frame);
  }
  demand(clean.size() + whole.skipped_bytes() <= input.stream.size(), "no byte is counted twice");
  Splitter again;
  demand(split<Frame>(again, clean, {}) == at_once, "frames that were read are written back");
  demand(again.skipped_bytes() == 0, "what is written has no garbage");
}

}  // namespace
}  // namespace weft::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  weft::fuzz::try_stream(weft::fuzz::ChunkedInput({data, size}));
  return 0;
}
