#pragma once
// Rows of samples as stored in the campaign file: fixed size, little-endian
// (docs/reference/dataset.md, "Chunks").

#include <cstdint>
#include <span>
#include <string_view>

#include "daemon/storage/dataset/dataset.hpp"
#include "drivers/api/sample.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {

enum class Stream : std::uint8_t { taxel = 0, wrench = 1, stages = 2, acceleration = 3, sound = 4 };
constexpr std::size_t stream_count = 5;
std::string_view to_string(Stream stream);

/// Bytes of one row. `width`: number of taxels, of axes or of values in a block; ignored for the
/// wrench.
constexpr std::size_t row_bytes(Stream stream, std::size_t width) {
  switch (stream) {
    case Stream::taxel:
      return 8 + 4 + 2 + 2 + 1 + 2 * width;
    case Stream::wrench:
      return 8 + 4 + 1 + 4 * 6;
    case Stream::acceleration:
    case Stream::sound:
      return 8 + 4 + 4 + 4 * width;
    case Stream::stages:
      break;
  }
  return 8 + 4 * width;
}

/// Rows with consecutive sequence numbers. A gap or a repeated number starts a new chunk.
class ChunkBuffer {
 public:
  ChunkBuffer(Stream stream, std::size_t width, std::size_t capacity_rows);

  [[nodiscard]] bool empty() const { return rows_ == 0; }
  [[nodiscard]] bool full() const { return rows_ == capacity_rows_; }
  /// False if a row with these numbers would not be consecutive.
  [[nodiscard]] bool continues(std::uint32_t sequence, std::uint32_t lost) const {
    return empty() || (lost == 0 && sequence == first_sequence_ + rows_);
  }

  /// Space for the next row: fill it completely, then call push(). The buffer must not be full.
  std::span<std::uint8_t> slot();
  void push(std::uint32_t sequence, std::uint32_t lost, TimePoint host);
  void clear() { rows_ = 0; }

  [[nodiscard]] Stream stream() const { return stream_; }
  [[nodiscard]] std::size_t width() const { return width_; }
  [[nodiscard]] ByteView bytes() const { return ByteView(bytes_).first(rows_ * row_bytes_); }
  [[nodiscard]] std::uint32_t rows() const { return rows_; }
  [[nodiscard]] std::uint32_t first_sequence() const { return first_sequence_; }
  [[nodiscard]] std::uint32_t lost_before() const { return lost_before_; }
  [[nodiscard]] std::int64_t t0_ns() const { return t0_ns_; }

 private:
  Stream stream_;
  std::size_t width_;
  std::size_t row_bytes_;
  std::uint32_t capacity_rows_;
  Bytes bytes_;  ///< allocated once
  std::uint32_t rows_ = 0;
  std::uint32_t first_sequence_ = 0;
  std::uint32_t lost_before_ = 0;
  std::int64_t t0_ns_ = 0;
};

void encode_taxel(std::span<std::uint8_t> row, TimePoint host, const TaxelSample& sample,
                  Phase phase);
/// Errors: range for a value that the quantum cannot represent (NaN included).
Status encode_wrench(std::span<std::uint8_t> row, TimePoint host, const WrenchSample& sample);
Status encode_stages(std::span<std::uint8_t> row, TimePoint host, std::span<const double> positions,
                     std::span<const Axis> axes);

/// One block of a vibration sensor; it is one row, whatever its number of readings.
struct BlockRow {
  std::uint32_t device_us = 0;
  std::uint32_t clipped = 0;
  std::span<const double> values;  ///< [m/s2] or [Pa]
  double quanta_per_unit = 1;
};
Status encode_block(std::span<std::uint8_t> row, TimePoint host, const BlockRow& block);

/// Appends rows of one chunk to a trial. `width` as above; `rows` holds whole rows. Taxel rows of
/// Phase::none (approach and retract) are left out. False if a phase byte is unknown.
bool decode_taxels(ByteView rows, classifier::Trial& trial, TrialRecord& record);
void decode_wrench(ByteView rows, WrenchStream& stream);
void decode_stages(ByteView rows, std::size_t axes, StageStream& stream);
/// `lost_before`: samples lost before the chunk, so before its first row.
void decode_blocks(ByteView rows, std::size_t values, std::uint32_t lost_before,
                   BlockStream& stream);

}  // namespace weft::daemon
