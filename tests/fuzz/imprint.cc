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
  try_frames<Splitter, Frame>(
      input, [](const Splitter& splitter) { return splitter.damaged(); }, look_at);
}

}  // namespace
}  // namespace weft::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  weft::fuzz::try_stream(weft::fuzz::ChunkedInput({data, size}));
  return 0;
}
