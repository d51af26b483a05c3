#include "protocols/base/frame_splitter.hpp"

#include "protocols/base/bytes.hpp"

namespace weft {
namespace {

constexpr std::size_t sync_size = std::tuple_size_v<SyncBytes>;
constexpr std::size_t head_check_at = 12;
constexpr std::uint8_t version = 1;

}  // namespace

bool FrameHead::begins(ByteView bytes, const SyncBytes& sync) {
  return bytes[0] == sync[0] && bytes[1] == sync[1] && bytes[2] == version;
}

std::optional<FrameHead> FrameHead::decode(ByteView bytes) {
  LittleReader reader(bytes.subspan(3));
  FrameHead head;
  head.kind = reader.read<std::uint8_t>();
  head.body_size = reader.read<std::uint16_t>();
  head.sequence = reader.read<std::uint16_t>();
  head.device_us = reader.read<std::uint32_t>();
  const bool agrees = reader.read<std::uint16_t>() ==
                      crc16_ccitt(bytes.subspan(sync_size, head_check_at - sync_size));
  return agrees ? std::optional(head) : std::nullopt;
}

bool FrameHead::tail_agrees(ByteView frame) {
  const ByteView covered = frame.subspan(sync_size, frame.size() - sync_size - tail_size);
  return LittleReader(frame.last(tail_size)).read<std::uint32_t>() == crc32(covered);
}

void FrameHead::append(Bytes& out, const SyncBytes& sync) const {
  const std::size_t start = out.size();
  LittleWriter writer(out);
  writer.put(sync).write(version).write(kind).write(body_size).write(sequence).write(device_us);
  writer.write(crc16_ccitt(ByteView(out).subspan(start + sync_size)));
}

void FrameHead::append_tail(Bytes& out, std::size_t frame_start) {
  LittleWriter(out).write(crc32(ByteView(out).subspan(frame_start + sync_size)));
}

}  // namespace weft
