#pragma once
// FrameSplitter: base of the splitters that split a stream into frames. FrameHead: head and tail of
// the frames of most of Weft's own sensors, with check values, little-endian. The layouts are in
// the READMEs of protocols/taxel, vibro and imprint.

#include <array>
#include <cstdint>
#include <optional>

#include "protocols/base/stream_buffer.hpp"

namespace weft {

using SyncBytes = std::array<std::uint8_t, 2>;

/// Head and tail of a frame. Head: sync, version 1, kind, body size in bytes, sequence, device
/// clock, CRC-16 of the head after sync. Then follow the body and a CRC-32 of all bytes after sync.
/// The head has its own check value, so a damaged length does not make the receiver wait for bytes
/// that never arrive.
struct FrameHead {
  std::uint8_t kind = 0;
  std::uint16_t body_size = 0;
  std::uint16_t sequence = 0;
  std::uint32_t device_us = 0;

  static constexpr std::size_t size = 14, tail_size = 4;

  /// Whether a head may begin here, by sync and version. `bytes` has at least `size` bytes.
  static bool begins(ByteView bytes, const SyncBytes& sync);
  /// nullopt for a wrong check value.
  static std::optional<FrameHead> decode(ByteView bytes);
  /// Whether the check value at the end of a complete frame is right.
  static bool tail_agrees(ByteView frame);

  [[nodiscard]] std::size_t frame_size() const { return size + body_size + tail_size; }
  /// Appends the head, the body that `write_body` writes with the LittleWriter it receives, and the
  /// tail. Does not allocate if `out` has enough capacity.
  template <class WriteBody>
  void append_frame(Bytes& out, const SyncBytes& sync, const WriteBody& write_body) const {
    const std::size_t start = out.size();
    append(out, sync);
    write_body(LittleWriter(out));
    append_tail(out, start);
  }

 private:
  void append(Bytes& out, const SyncBytes& sync) const;
  static void append_tail(Bytes& out, std::size_t frame_start);
};

/// Base of splitters. push() a chunk, then call the protocol's next() until it returns false. The
/// chunking of a stream does not affect the frames. Bytes outside a frame are skipped. After a
/// wrong check value the search continues one byte later, so a good frame after a damaged one is
/// not lost.
class FrameSplitter {
 public:
  void push(ByteView bytes) { buffer_.push(bytes); }
  /// Discards a frame in progress; the counters keep their values.
  void clear() { buffer_.clear(); }

  /// After next() returned false: whether a frame is in progress.
  [[nodiscard]] bool in_progress() const { return !buffer_.view().empty(); }

  /// Bytes that belong to no frame or exceeded the capacity.
  [[nodiscard]] std::uint64_t skipped_bytes() const { return buffer_.skipped_bytes(); }
  /// Frames with a plausible head that were invalid.
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }

 protected:
  /// Result of `measure` where no frame begins.
  static constexpr std::size_t no_frame = 0;

  /// `capacity`: maximum of bytes that next() has not consumed.
  explicit FrameSplitter(std::size_t capacity) : buffer_(capacity) {}

  /// Consumes the next frame. `measure` gets at least `head_size` bytes and returns the size of the
  /// frame, no_frame, or nullopt for a damaged head. `read` gets a complete frame and returns
  /// whether it is good.
  template <class Measure, class Read>
  bool find(std::size_t head_size, const Measure& measure, const Read& read) {
    for (ByteView bytes = buffer_.view(); bytes.size() >= head_size; bytes = buffer_.view()) {
      const std::optional<std::size_t> size = measure(bytes);
      if (size && bytes.size() < *size) return false;
      if (size && size != no_frame && read(bytes.first(*size))) {
        buffer_.consume(*size);
        return true;
      }
      if (size != no_frame) ++damaged_;
      buffer_.skip(1);
    }
    return false;
  }

  /// The same for frames with a FrameHead. `makes_sense`: whether such a head exists.
  /// `read_body(head, body)`: whether the body is good.
  template <class MakesSense, class ReadBody>
  bool find(const SyncBytes& sync, const MakesSense& makes_sense, const ReadBody& read_body) {
    std::optional<FrameHead> head;
    const auto measure = [&](ByteView bytes) -> std::optional<std::size_t> {
      if (!FrameHead::begins(bytes, sync)) return no_frame;
      head = FrameHead::decode(bytes);
      return head && makes_sense(*head) ? std::optional(head->frame_size()) : std::nullopt;
    };
    return find(FrameHead::size, measure, [&](ByteView frame) {
      return FrameHead::tail_agrees(frame) &&
             read_body(*head, frame.subspan(FrameHead::size, head->body_size));
    });
  }

 private:
  StreamBuffer buffer_;
  std::uint64_t damaged_ = 0;
};

}  // namespace weft
