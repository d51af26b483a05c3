#include "protocols/imprint/imprint.hpp"

#include <algorithm>

#include "protocols/base/result.hpp"

namespace weft::protocols::imprint {
namespace {

constexpr std::size_t largest_body = window_size + max_taxels;

/// Whether the kind exists and its body has a valid size.
bool makes_sense(const FrameHead& head) {
  switch (static_cast<Kind>(head.kind)) {
    case Kind::description:
      return head.body_size == description_size;
    case Kind::scan:
      return head.body_size > window_size && head.body_size <= largest_body;
    case Kind::request:
      return head.body_size == window_size;
  }
  return false;
}

Window read_window(LittleReader& reader) {
  Window window;
  for (std::uint8_t* member : {&window.first_row, &window.first_col, &window.rows, &window.cols})
    *member = reader.read<std::uint8_t>();
  return window;
}

void write_window(LittleWriter& writer, const Window& window) {
  writer.write(window.first_row).write(window.first_col).write(window.rows).write(window.cols);
}

Description read_description(LittleReader& reader) {
  Description description;
  description.serial = reader.read<std::uint32_t>();
  for (std::uint8_t& part : description.firmware) part = reader.read<std::uint8_t>();
  description.rows = reader.read<std::uint8_t>();
  description.cols = reader.read<std::uint8_t>();
  description.bits = reader.read<std::uint8_t>();
  description.spacing_um = reader.read<std::uint16_t>();
  description.full_scale_pa = reader.read<std::uint32_t>();
  description.period_us = reader.read<std::uint32_t>();
  return description;
}

void write_description(LittleWriter& writer, const Description& description) {
  writer.write(description.serial).put(description.firmware);
  writer.write(description.rows).write(description.cols).write(description.bits);
  writer.write(description.spacing_um).write(description.full_scale_pa);
  writer.write(description.period_us);
}

/// False for an invalid window, a taxel count that differs from the window's, or a count of eight
/// bits.
bool read_frame(const FrameHead& head, ByteView body, Frame& frame) {
  frame.kind = static_cast<Kind>(head.kind);
  frame.sequence = head.sequence;
  frame.device_us = head.device_us;
  frame.description = {};
  frame.window = {};
  LittleReader reader(body);
  if (frame.kind == Kind::description) {
    frame.description = read_description(reader);
    return true;
  }
  frame.window = read_window(reader);
  if (!makes_sense(frame.window)) return false;
  if (frame.kind == Kind::request) return true;
  const ByteView counts = body.subspan(window_size);
  if (counts.size() != frame.window.taxels()) return false;
  if (std::ranges::any_of(counts, [](std::uint8_t c) { return c > highest_count; })) return false;
  std::ranges::copy(counts, frame.counts.begin());
  return true;
}

}  // namespace

bool Frame::operator==(const Frame& other) const {
  return kind == other.kind && sequence == other.sequence && device_us == other.device_us &&
         description == other.description && window == other.window &&
         std::ranges::equal(taxels(), other.taxels());
}

void append(Bytes& out, const Frame& frame) {
  const bool describes = frame.kind == Kind::description;
  WEFT_ASSERT(describes || makes_sense(frame.window));
  WEFT_ASSERT(std::ranges::all_of(frame.taxels(), [](auto c) { return c <= highest_count; }));
  const std::size_t body_size = describes ? description_size : window_size + frame.taxels().size();
  const FrameHead head{static_cast<std::uint8_t>(frame.kind), static_cast<std::uint16_t>(body_size),
                       frame.sequence, frame.device_us};
  head.append_frame(out, sync, [&](LittleWriter writer) {
    if (describes)
      write_description(writer, frame.description);
    else
      write_window(writer, frame.window);
    writer.put(frame.taxels());
  });
}

bool Splitter::next(Frame& frame) {
  return find(
      sync, [](const FrameHead& head) { return makes_sense(head); },
      [&](const FrameHead& head, ByteView body) { return read_frame(head, body, frame); });
}

}  // namespace weft::protocols::imprint
