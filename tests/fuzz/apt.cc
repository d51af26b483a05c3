// Thorlabs APT: messages, their bodies, and a stream split anywhere.

#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz::apt_target {
namespace {

using namespace protocols::apt;

/// A layout reads exactly its own size and writes the same bytes.
template <class Body>
void try_body(ByteView data) {
  const Result<Body> body = decode_body<Body>(data);
  demand(body.has_value() == (data.size() == body_size<Body>), "a body has exactly its size");
  if (!body) return demand(!body.error().what.empty(), "an error says what is wrong");
  Bytes again;
  append_body(again, *body);
  demand(std::equal(again.begin(), again.end(), data.begin(), data.end()),
         "a body that was read is written back");
}

template <class... Bodies>
void try_bodies(ByteView data) {
  (try_body<Bodies>(data), ...);
}

void try_message(ByteView bytes) {
  const Result<Message> message = decode(bytes);
  if (!message) return demand(!message.error().what.empty(), "an error says what is wrong");
  const Bytes again = encode(*message);
  demand(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()),
         "a message that was read is written back");
  try_bodies<HardwareInfo, RichResponse, ChannelCounts, VelocityParams, JogParams,
             LimitSwitchParams, PowerParams, HomeParams, StatusBits, StatusUpdate, DcStatusUpdate,
             BowIndex, AdcInputs, RackStatusBits, PotParams, ButtonParams, KcubePanelParams>(
      message->data);
}

void try_stream(const ChunkedInput& input, LineEnd line_end) {
  Splitter whole(line_end);
  Splitter pieces(line_end);
  const auto at_once = split<Message>(whole, input.stream, {});
  demand(at_once == split<Message>(pieces, input.stream, input.sizes),
         "any chunking gives the same messages");
  demand(whole.skipped_bytes() == pieces.skipped_bytes(), "any chunking skips the same bytes");
  std::size_t used = whole.skipped_bytes();
  for (const Message& message : at_once) {
    const Bytes bytes = encode(message);
    used += bytes.size();
    demand(decode(bytes).has_value(), "what the splitter passes on is a message");
    demand(message.data.size() <= max_data_size, "data are as short as the protocol says");
  }
  demand(used <= input.stream.size(), "no byte is counted twice");
}

}  // namespace

WEFT_FUZZ_TARGET(apt) {
  const ChunkedInput input({data, size});
  try_message(input.stream);
  for (const auto line_end :
       {weft::protocols::apt::LineEnd::host, weft::protocols::apt::LineEnd::controller})
    try_stream(input, line_end);
  return 0;
}

}  // namespace weft::fuzz::apt_target
