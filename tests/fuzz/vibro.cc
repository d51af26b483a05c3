// The vibration sensor's stream.

#include "protocols/vibro/vibro.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz::vibro_target {
namespace {

using namespace protocols::vibro;

void inspect(const Frame& frame) {
  if (frame.kind == Kind::description) return demand(frame.value_count == 0, "it has no values");
  demand(frame.value_count >= 1 && frame.value_count <= max_values, "1 to 1536 values");
  demand(frame.value_count % values_per_reading(frame.kind) == 0, "whole readings");
}

void try_stream(const ChunkedInput& input) {
  try_frames<Splitter, Frame>(
      input, [](const Splitter& splitter) { return splitter.damaged(); }, inspect);
}

}  // namespace

WEFT_FUZZ_TARGET(vibro) {
  try_stream(ChunkedInput({data, size}));
  return 0;
}

}  // namespace weft::fuzz::vibro_target
