#include "protocols/ati_digital/stream.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace weft::protocols::ati_digital {
namespace {

constexpr std::array<std::size_t, gauges> gauge_at_wire_position{0, 2, 4, 1, 3, 5};
constexpr std::uint8_t sum_mask = 0x7F;
constexpr std::uint8_t error_bit = 0x80;

std::uint8_t sum_of(ByteView counts) {
  unsigned sum = 0;
  for (const std::uint8_t byte : counts) sum += byte;
  return static_cast<std::uint8_t>(sum & sum_mask);
}

bool sum_holds(ByteView record) {
  return sum_of(record.first(record_size - 1)) == (record[record_size - 1] & sum_mask);
}

/// Number of consecutive valid records from the first byte on, at most `most`.
std::size_t records_in_row(ByteView bytes, std::size_t most) {
  std::size_t count = 0;
  while (count < most && bytes.size() >= (count + 1) * record_size &&
         sum_holds(bytes.subspan(count * record_size, record_size)))
    ++count;
  return count;
}

}  // namespace

void append(Bytes& out, const StreamRecord& record) {
  const std::size_t start = out.size();
  BigWriter writer(out);
  for (const std::size_t gauge : gauge_at_wire_position) writer.write(record.gauge_counts[gauge]);
  const std::uint8_t sum = sum_of(ByteView(out).subspan(start));
  writer.write(static_cast<std::uint8_t>(sum | (record.status_error ? error_bit : 0)));
}

std::optional<StreamRecord> decode_record(ByteView bytes) {
  if (bytes.size() < record_size || !sum_holds(bytes.first(record_size))) return std::nullopt;
  BigReader reader(bytes);
  StreamRecord record;
  for (const std::size_t gauge : gauge_at_wire_position)
    record.gauge_counts[gauge] = reader.read<std::int16_t>();
  record.status_error = (reader.read<std::uint8_t>() & error_bit) != 0;
  return record;
}

void StreamSplitter::begin_in_step() {
  begin_anywhere();
  in_step_ = true;
}

void StreamSplitter::begin_anywhere() {
  buffer_.clear();
  in_step_ = have_last_ = damaged_here_ = false;
  dropped_since_record_ = 0;
}

void StreamSplitter::drop(std::size_t bytes) {
  buffer_.skip(bytes);
  dropped_since_record_ += bytes;
}

bool StreamSplitter::next(StreamRecord& record, std::uint32_t& lost) {
  while (in_step_ || find_step()) {
    const ByteView bytes = buffer_.view();
    if (bytes.size() < record_size) return false;
    const std::optional<StreamRecord> decoded = decode_record(bytes);
    if (!decoded) {
      in_step_ = false;
      damaged_here_ = have_last_;
      ++resynchronisations_;
      continue;
    }
    buffer_.consume(record_size);
    record = last_ = *decoded;
    const std::uint64_t dropped = std::exchange(dropped_since_record_, 0);
    const std::uint64_t records = (dropped + record_size / 2) / record_size;
    const bool before_first = !std::exchange(have_last_, true);
    lost = dropped == 0 || before_first
               ? 0
               : static_cast<std::uint32_t>(std::max<std::uint64_t>(records, 1));
    return true;
  }
  return false;
}

/// Drops bytes up to the next record. Returns false if there are too few bytes to decide; then it
/// drops only bytes that cannot begin a record.
bool StreamSplitter::find_step() {
  const ByteView bytes = buffer_.view();
  if (damaged_here_) {
    if (bytes.size() < (1 + records_to_resume) * record_size) return false;
    if (continues_behind_damage()) return true;
  }
  constexpr std::size_t needed = (records_to_agree + 1) * record_size;
  std::size_t at = 0;
  for (; bytes.size() >= at + needed; ++at) {
    if (records_in_row(bytes.subspan(at), records_to_agree) < records_to_agree) continue;
    const std::optional<std::size_t> begin = begin_of_step(bytes.subspan(at));
    drop(at + begin.value_or(0));
    return in_step_ = begin.has_value();
  }
  drop(at);
  return false;
}

/// Drops the failed record if the records after it show that nothing else is missing.
bool StreamSplitter::continues_behind_damage() {
  damaged_here_ = false;
  const ByteView behind = buffer_.view().subspan(record_size);
  if (records_in_row(behind, records_to_resume) < records_to_resume ||
      distance(behind) > near_counts)
    return false;
  drop(record_size);
  return in_step_ = true;
}

/// Selects one of the 13 phases after a position where one agrees. nullopt: more bytes are needed.
std::optional<std::size_t> StreamSplitter::begin_of_step(ByteView bytes) const {
  std::array<std::size_t, record_size> rows{};
  for (std::size_t phase = 0; phase < record_size; ++phase)
    rows[phase] = records_in_row(bytes.subspan(phase), records_to_decide);
  const auto agrees = [](std::size_t row) { return row >= records_to_agree; };
  if (std::count_if(rows.begin(), rows.end(), agrees) == 1)
    return static_cast<std::size_t>(std::find_if(rows.begin(), rows.end(), agrees) - rows.begin());
  if (bytes.size() < (records_to_decide + 1) * record_size) return std::nullopt;
  const std::size_t longest = *std::max_element(rows.begin(), rows.end());
  std::size_t best = record_size;
  for (std::size_t phase = 0; phase < record_size; ++phase) {
    if (rows[phase] < longest) continue;
    if (best == record_size || distance(bytes.subspan(phase)) < distance(bytes.subspan(best)))
      best = phase;
  }
  return best;
}

/// Distance from the last good record in counts, summed over the gauges; 0 if there was none.
int StreamSplitter::distance(ByteView bytes) const {
  const std::optional<StreamRecord> record = decode_record(bytes);
  if (!have_last_ || !record) return 0;
  int sum = 0;
  for (std::size_t i = 0; i < gauges; ++i)
    sum += std::abs(record->gauge_counts[i] - last_.gauge_counts[i]);
  return sum;
}

}  // namespace weft::protocols::ati_digital
