// The vibration sensor's stream.

#include "protocols/vibro/vibro.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz {
namespace {

using namespace protocols::vibro;

void look_at(const Frame& frame) {
  if (frame.kind == Kind::description) return demand(frame.value_count == 0, "it has no values");
  demand(frame.value_count >= 1 && frame.value_count <= max_values, "1 to 1536 values");
  demand(frame.value_count % values_per_reading(frame.kind) == 0, "whole readings");
}

void try_stream(const ChunkedInput& input) {
  Splitter whole;
  Splitter pieces;
  const auto at_once = split<Frame>(whole, input.stream, {});
  demand(at_once == split<Frame>(pieces, input.stream, input.sizes),
         "any chunking gives the same frames");
  demand(whole.crc_errors() == pieces.crc_errors(), "any chunking sees the same damage");
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
