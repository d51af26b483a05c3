#pragma once
// The stream of an ATI Digital F/T sensor: records of 13 bytes without a start byte, a number or a
// CRC. Source: docs/reference/device-facts.md, ATI Digital F/T.

#include <array>
#include <cstdint>
#include <optional>

#include "protocols/ati_digital/registers.hpp"
#include "protocols/base/bytes.hpp"
#include "protocols/base/stream_buffer.hpp"

namespace weft::protocols::ati_digital {

inline constexpr std::size_t record_size = 13;

struct StreamRecord {
  std::array<std::int16_t, gauges> gauge_counts{};  ///< gauge 0 to 5; on the wire 0 2 4 1 3 5
  bool status_error = false;                        ///< see the status word

  bool operator==(const StreamRecord&) const = default;
};

/// Appends 13 bytes. Allocates nothing when `out` has room.
void append(Bytes& out, const StreamRecord& record);

/// The first 13 of `bytes` as a record; nothing when there are fewer or the sum does not hold.
std::optional<StreamRecord> decode_record(ByteView bytes);

/// Finds the records in the stream. While in step each record's sum is checked. When one fails and
/// `records_to_resume` behind it hold, the first of them near the last good one, it was damaged in
/// its place and is dropped. Otherwise the records that follow are looked for at all 13 phases: one
/// is taken when `records_to_agree` of its sums in a row hold, and no other phase's do. The sums of
/// a load that does not change at all can hold at several phases for ever: after
/// `records_to_decide`, the phase whose first record is nearest to the last good one wins.
///
/// push() a chunk, then call next() until it returns false; any chunking gives the same records.
class StreamSplitter {
 public:
  static constexpr std::size_t capacity = 65536;
  static constexpr std::size_t records_to_resume = 3;
  /// Sum over the gauges. Bytes of another phase are anything up to 65535 each.
  static constexpr int near_counts = 6 * 1000;
  static constexpr std::size_t records_to_agree = 4;
  static constexpr std::size_t records_to_decide = 16;

  /// The first byte that comes begins a record: right behind the answer to the start request.
  void begin_in_step();
  /// Nothing is known about where a record begins.
  void begin_anywhere();

  void push(ByteView bytes) { dropped_since_record_ += buffer_.push(bytes); }
  /// The next record, and how many were damaged or missing right before it, as far as the bytes
  /// tell: whole records that never came leave no trace.
  bool next(StreamRecord& record, std::uint32_t& lost);

  [[nodiscard]] bool in_step() const { return in_step_; }
  /// Bytes that were part of no record.
  [[nodiscard]] std::uint64_t dropped_bytes() const { return buffer_.skipped_bytes(); }
  /// How often the step was lost.
  [[nodiscard]] std::uint64_t resynchronisations() const { return resynchronisations_; }

 private:
  bool find_step();
  bool continues_behind_damage();
  [[nodiscard]] std::optional<std::size_t> begin_of_step(ByteView bytes) const;
  [[nodiscard]] int distance(ByteView record) const;
  void drop(std::size_t bytes);

  StreamBuffer buffer_{capacity};
  StreamRecord last_;
  bool have_last_ = false;
  bool in_step_ = false;
  bool damaged_here_ = false;  ///< what comes next failed, and was in step
  std::uint64_t dropped_since_record_ = 0;
  std::uint64_t resynchronisations_ = 0;
};

}  // namespace weft::protocols::ati_digital
