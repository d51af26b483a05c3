#include "protocols/imprint/imprint.hpp"

#include <algorithm>
#include <optional>

#include "protocols/base/crc.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::imprint {
namespace {

constexpr std::size_t head_check_at = 12;
constexpr std::size_t largest_body = window_size + max_taxels;

struct Head {
  Kind kind{};
  std::size_t body_size = 0;
};

/// The head of a frame, where these are one: right check value, a kind, a body that it may have.
std::optional<Head> decode_head(ByteView head) {
  LittleReader check(head.subspan(head_check_at, 2));
  if (check.read<std::uint16_t>() != crc16_ccitt(head.subspan(2, head_check_at - 2)))
    return std::nullopt;
  LittleReader reader(head.subspan(3));
  const std::uint8_t kind = reader.read<std::uint8_t>();
  const Head out{static_cast<Kind>(kind), reader.read<std::uint16_t>()};
  const auto fits = [&] {
    switch (out.kind) {
      case Kind::description:
        return out.body_size == description_size;
      case Kind::scan:
        return out.body_size > window_size && out.body_size <= largest_body;
      case Kind::request:
        return out.body_size == window_size;
    }
    return false;
  };
  return fits() ? std::optional(out) : std::nullopt;
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

/// False for a window that is none, another number of taxels than it has, a count of eight bits.
bool read_body(LittleReader& reader, ByteView body, Frame& frame) {
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

bool read_frame(ByteView bytes, const Head& head, Frame& frame) {
  const ByteView covered = bytes.subspan(sync.size(), bytes.size() - sync.size() - tail_size);
  if (LittleReader(bytes.last(tail_size)).read<std::uint32_t>() != crc32(covered)) return false;
  LittleReader reader(bytes.subspan(6));
  frame.kind = head.kind;
  frame.sequence = reader.read<std::uint16_t>();
  frame.device_us = reader.read<std::uint32_t>();
  reader.take(2);
  frame.description = {};
  frame.window = {};
  return read_body(reader, bytes.subspan(head_size, head.body_size), frame);
}

std::size_t body_size(const Frame& frame) {
  if (frame.kind == Kind::description) return description_size;
  return window_size + frame.taxels().size();
}

}  // namespace

bool Frame::operator==(const Frame& other) const {
  return kind == other.kind && sequence == other.sequence && device_us == other.device_us &&
         description == other.description && window == other.window &&
         std::ranges::equal(taxels(), other.taxels());
}

void append(Bytes& out, const Frame& frame) {
  WEFT_ASSERT(frame.kind == Kind::description || makes_sense(frame.window));
  WEFT_ASSERT(std::ranges::all_of(frame.taxels(), [](auto c) { return c <= highest_count; }));
  const std::size_t start = out.size();
  const auto since_sync = [&] { return ByteView(out).subspan(start + sync.size()); };
  LittleWriter writer(out);
  writer.put(sync).write(version).write(static_cast<std::uint8_t>(frame.kind));
  writer.write(static_cast<std::uint16_t>(body_size(frame)));
  writer.write(frame.sequence).write(frame.device_us);
  writer.write(crc16_ccitt(since_sync()));
  if (frame.kind == Kind::description)
    write_description(writer, frame.description);
  else
    write_window(writer, frame.window);
  writer.put(frame.taxels());
  writer.write(crc32(since_sync()));
}

bool Splitter::next(Frame& frame) {
  const auto skip = [this](std::uint64_t damaged) {
    buffer_.skip(1);
    damaged_ += damaged;
  };
  for (ByteView bytes = buffer_.view(); bytes.size() >= head_size; bytes = buffer_.view()) {
    if (bytes[0] != sync[0] || bytes[1] != sync[1] || bytes[2] != version) {
      skip(0);
      continue;
    }
    const std::optional<Head> head = decode_head(bytes.first(head_size));
    if (!head) {
      skip(1);
      continue;
    }
    const std::size_t size = frame_size(head->body_size);
    if (bytes.size() < size) return false;
    if (!read_frame(bytes.first(size), *head, frame)) {
      skip(1);
      continue;
    }
    buffer_.consume(size);
    return true;
  }
  return false;
}

}  // namespace weft::protocols::imprint
