// The imprint array's stream, and the requests of a host.

#include "protocols/imprint/imprint.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz::imprint_target {
namespace {

using namespace protocols::imprint;

void inspect(const Frame& frame) {
  if (frame.kind == Kind::description) return demand(frame.taxels().empty(), "it has no taxels");
  demand(makes_sense(frame.window), "a window within the largest array");
  for (const std::uint8_t count : frame.taxels()) demand(count <= highest_count, "seven bits");
}

void try_stream(const ChunkedInput& input) {
  try_frames<Splitter, Frame>(
      input, [](const Splitter& splitter) { return splitter.damaged(); }, inspect);
}

}  // namespace

WEFT_FUZZ_TARGET(imprint) {
  try_stream(ChunkedInput({data, size}));
  return 0;
}

}  // namespace weft::fuzz::imprint_target
