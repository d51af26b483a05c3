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
  try_frames<Splitter, Frame>(
      input, [](const Splitter& splitter) { return splitter.crc_errors(); }, look_at);
}

}  // namespace
}  // namespace weft::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  weft::fuzz::try_stream(weft::fuzz::ChunkedInput({data, size}));
  return 0;
}
