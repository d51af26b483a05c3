#include "protocols/taxel/taxel.hpp"

#include <string>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::taxel {
namespace {

constexpr std::size_t head_size = 4;  // sync, version, taxel count
constexpr std::size_t crc_size = 2;

constexpr bool plausible_head(ByteView head) {
  return head[0] == sync[0] && head[1] == sync[1] && head[2] == version && head[3] >= 1 &&
         head[3] <= max_taxels;
}

bool crc_agrees(ByteView frame) {
  const ByteView covered = frame.subspan(sync.size(), frame.size() - sync.size() - crc_size);
  return LittleReader(frame.last(crc_size)).read<std::uint16_t>() == crc16_ccitt(covered);
}

void read_frame(ByteView bytes, Frame& frame) {
  LittleReader reader(bytes.subspan(head_size - 1));
  frame.taxel_count = reader.read<std::uint8_t>();
  frame.sequence = reader.read<std::uint16_t>();
  frame.device_us = reader.read<std::uint32_t>();
  frame.counts.fill(0);
  for (std::size_t i = 0; i < frame.taxel_count; ++i)
    frame.counts[i] = reader.read<std::uint16_t>();
  frame.proximity_counts = reader.read<std::uint16_t>();
  frame.ambient_counts = reader.read<std::uint16_t>();
}

}  // namespace

void append(Bytes& out, const Frame& frame) {
  WEFT_ASSERT(frame.taxel_count >= 1 && frame.taxel_count <= max_taxels);
  const std::size_t start = out.size();
  LittleWriter writer(out);
  writer.put(sync).write(version).write(frame.taxel_count).write(frame.sequence);
  writer.write(frame.device_us);
  for (const std::uint16_t counts : frame.taxels()) writer.write(counts);
  writer.write(frame.proximity_counts).write(frame.ambient_counts);
  writer.write(crc16_ccitt(ByteView(out).subspan(start + sync.size())));
}

bool Splitter::next(Frame& frame) {
  const auto size_of = [](ByteView bytes) {
    return plausible_head(bytes) ? frame_size(bytes[3]) : no_frame;
  };
  return find(head_size, size_of, [&](ByteView whole) {
    if (!crc_agrees(whole)) return false;
    read_frame(whole, frame);
    return true;
  });
}

namespace cpm {
namespace {

constexpr std::size_t values_per_frame = 4;
constexpr std::uint8_t all_parts = 0x0F;

void put_u16(CanFrame& frame, std::size_t index, std::uint16_t word) {
  frame.data[2 * index] = static_cast<std::uint8_t>(word);
  frame.data[2 * index + 1] = static_cast<std::uint8_t>(word >> 8);
}

std::uint16_t u16_at_index(const CanFrame& frame, std::size_t index) {
  return static_cast<std::uint16_t>(frame.data[2 * index] | frame.data[2 * index + 1] << 8);
}

}  // namespace

std::array<std::uint8_t, datagram_size> encode_datagram(const Counts& counts) {
  std::array<std::uint8_t, datagram_size> out{};
  for (std::size_t i = 0; i < taxels; ++i) {
    const std::uint16_t word = counts[taxel_at_wire_position[i]];
    out[2 * i] = static_cast<std::uint8_t>(word >> 8);
    out[2 * i + 1] = static_cast<std::uint8_t>(word);
  }
  return out;
}

Result<Counts> decode_datagram(ByteView datagram) {
  if (datagram.size() != datagram_size)
    return fail({.code = Errc::parse,
                 .what = "CPM-Finger datagram has the wrong length",
                 .expected = "32 bytes",
                 .got = std::to_string(datagram.size()) + " bytes"});
  BigReader reader(datagram);
  Counts counts{};
  for (const std::uint8_t taxel : taxel_at_wire_position)
    counts[taxel] = reader.read<std::uint16_t>();
  return counts;
}

std::array<CanFrame, 5> encode_can(const Scan& scan) {
  std::array<CanFrame, 5> frames{};
  for (std::size_t i = 0; i < taxels; ++i)
    put_u16(frames[i / values_per_frame], i % values_per_frame,
            scan.counts[taxel_at_wire_position[i]]);
  for (std::size_t part = 0; part < can_taxel_ids.size(); ++part)
    frames[part].id = can_taxel_ids[part];
  frames[4].id = can_proximity_id;
  frames[4].length = 4;
  put_u16(frames[4], 0, scan.proximity1_counts);
  put_u16(frames[4], 1, scan.proximity2_counts);
  return frames;
}

std::optional<Scan> CanAssembler::push(const CanFrame& frame) {
  if (frame.id == can_proximity_id && frame.length == 4) return finish(frame);
  for (std::size_t part = 0; part < can_taxel_ids.size(); ++part)
    if (frame.id == can_taxel_ids[part] && frame.length == 8) store(frame, part);
  return std::nullopt;
}

void CanAssembler::store(const CanFrame& frame, std::size_t part) {
  const auto bit = static_cast<std::uint8_t>(1U << part);
  if ((parts_seen_ & bit) != 0) {  // the closing frame of the previous scan was lost
    ++incomplete_scans_;
    parts_seen_ = 0;
  }
  parts_seen_ = static_cast<std::uint8_t>(parts_seen_ | bit);
  for (std::size_t i = 0; i < values_per_frame; ++i)
    scan_.counts[taxel_at_wire_position[part * values_per_frame + i]] = u16_at_index(frame, i);
}

std::optional<Scan> CanAssembler::finish(const CanFrame& frame) {
  const bool whole = parts_seen_ == all_parts;
  parts_seen_ = 0;
  if (!whole) {
    ++incomplete_scans_;
    return std::nullopt;
  }
  scan_.proximity1_counts = u16_at_index(frame, 0);
  scan_.proximity2_counts = u16_at_index(frame, 1);
  return scan_;
}

}  // namespace cpm

}  // namespace weft::protocols::taxel
