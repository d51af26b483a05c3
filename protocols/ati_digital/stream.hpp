#pragma once
// The stream of an ATI Digital F/T sensor: records of 13 bytes without start byte, sequence number
// or CRC. Source: docs/reference/device-facts.md, ATI Digital F/T.

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

/// Appends 13 bytes. Does not allocate if `out` has enough capacity.
void append(Bytes& out, const StreamRecord& record);

/// Decodes the first 13 of `bytes`; nullopt if there are fewer or the sum is wrong.
std::optional<StreamRecord> decode_record(ByteView bytes);

/// Finds the records in the stream. While in step, it checks the sum of each record. A failed
/// record is dropped as damaged if the next `records_to_resume` records are valid and the first of
/// them is near the last good one. Otherwise the splitter searches all 13 phases. It selects a
/// phase if `records_to_agree` of its sums in a row are valid and no other phase has as many. Under
/// a constant load the sums can be valid at several phases forever. Then, after
/// `records_to_decide`, the phase with the first record nearest to the last good one is selected.
///
/// push() a chunk, then call next() until it returns false. The chunking does not affect the
/// records.
class StreamSplitter {
 public:
  static constexpr std::size_t capacity = 65536;
  static constexpr std::size_t records_to_resume = 3;
  /// Largest distance in counts, summed over the gauges, that counts as near. Bytes read at a wrong
  /// phase differ by up to 65535 per gauge.
  static constexpr int near_counts = 6 * 1000;
  static constexpr std::size_t records_to_agree = 4;
  static constexpr std::size_t records_to_decide = 16;

  /// The next byte begins a record: it follows the answer to the start request.
  void begin_in_step();
  /// The next byte may be any byte of a record.
  void begin_anywhere();

  void push(ByteView bytes) { dropped_since_record_ += buffer_.push(bytes); }
  /// Returns the next record. `lost`: records damaged or missing right before it, as far as the
  /// bytes show. Records that are missing completely leave no trace.
  bool next(StreamRecord& record, std::uint32_t& lost);

  [[nodiscard]] bool in_step() const { return in_step_; }
  /// Bytes that were part of no record.
  [[nodiscard]] std::uint64_t dropped_bytes() const { return buffer_.skipped_bytes(); }
  /// Number of times the splitter lost the step.
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
  bool damaged_here_ = false;  ///< the next record failed its check while in step
  std::uint64_t dropped_since_record_ = 0;
  std::uint64_t resynchronisations_ = 0;
};

}  // namespace weft::protocols::ati_digital
