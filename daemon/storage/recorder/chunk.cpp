#include "daemon/storage/recorder/chunk.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace weft::daemon {
namespace {

/// Fills a row from its start; the caller has sized it with row_bytes().
class RowWriter {
 public:
  explicit RowWriter(std::span<std::uint8_t> row) : at_(row.data()) {}

  template <class Int>
  RowWriter& put(Int value) {
    const auto bits = static_cast<std::make_unsigned_t<Int>>(value);
    std::uint8_t* const to = at_;  // a local copy: a byte may alias any object, so a member would
                                   // be reloaded
    for (std::size_t i = 0; i < sizeof(Int); ++i)
      to[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(bits) >> (8 * i));
    at_ = to + sizeof(Int);
    return *this;
  }

 private:
  std::uint8_t* at_;
};

/// Same result as std::round() for values in range, but inlined: half away from zero.
std::int32_t nearest(double quanta) {
  const auto whole = static_cast<std::int32_t>(quanta);
  const double rest = quanta - whole;
  return whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0);
}

/// `what`: name of one value, for the error.
Status put_quanta(RowWriter& out, std::span<const double> values, double per_unit,
                  const char* what) {
  constexpr double limit = std::numeric_limits<std::int32_t>::max();
  for (const double value : values) {
    const double quanta = value * per_unit;
    if (!(std::abs(quanta) < limit + 0.5))
      return fail(
          {.code = Errc::range,
           .what = std::string(what) + " out of range",
           .expected = "at most " + std::to_string(limit / per_unit),
           .got = std::to_string(value),
           .hint = "Check the status and cable of the device, and its scale in the rig file"});
    out.put(nearest(quanta));
  }
  return {};
}

}  // namespace

std::string_view to_string(Stream stream) {
  constexpr std::array<std::string_view, stream_count> names{"taxel", "wrench", "stages",
                                                             "acceleration", "sound"};
  static_assert(names.size() == static_cast<std::size_t>(Stream::sound) + 1);
  return names.at(static_cast<std::size_t>(stream));
}

ChunkBuffer::ChunkBuffer(Stream stream, std::size_t width, std::size_t capacity_rows)
    : stream_(stream),
      width_(width),
      row_bytes_(daemon::row_bytes(stream, width)),
      capacity_rows_(static_cast<std::uint32_t>(capacity_rows)),
      bytes_(capacity_rows * row_bytes_) {}

std::span<std::uint8_t> ChunkBuffer::slot() {
  WEFT_ASSERT(!full());
  return std::span(bytes_).subspan(row_bytes_ * rows_, row_bytes_);
}

void ChunkBuffer::push(std::uint32_t sequence, std::uint32_t lost, TimePoint host) {
  WEFT_ASSERT(!full() && continues(sequence, lost));
  if (empty()) {
    first_sequence_ = sequence;
    lost_before_ = lost;
    t0_ns_ = ns_of(host);
  }
  ++rows_;
}

void encode_taxel(std::span<std::uint8_t> row, TimePoint host, const TaxelSample& sample,
                  Phase phase) {
  RowWriter out(row);
  out.put(ns_of(host)).put(sample.device_us).put(sample.proximity_counts);
  out.put(sample.ambient_counts).put(static_cast<std::uint8_t>(phase));
  for (const std::uint16_t count : sample.counts) out.put(count);
}

Status encode_wrench(std::span<std::uint8_t> row, TimePoint host, const WrenchSample& sample) {
  RowWriter out(row);
  out.put(ns_of(host)).put(sample.status).put(static_cast<std::uint8_t>(sample.valid ? 1 : 0));
  Status done = put_quanta(out, sample.force_n, force_quanta_per_n, "force [N]");
  return done ? put_quanta(out, sample.torque_nm, torque_quanta_per_nm, "torque [N m]") : done;
}

Status encode_stages(std::span<std::uint8_t> row, TimePoint host, std::span<const double> positions,
                     std::span<const Axis> axes) {
  RowWriter out(row);
  out.put(ns_of(host));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Status done =
        put_quanta(out, positions.subspan(i, 1), axes[i].quanta_per_unit(), "position [m or rad]");
    if (!done) return pass(done.error(), axes[i].name);
  }
  return {};
}

Status encode_block(std::span<std::uint8_t> row, TimePoint host, const BlockRow& block) {
  RowWriter out(row);
  out.put(ns_of(host)).put(block.device_us).put(block.clipped);
  return put_quanta(out, block.values, block.quanta_per_unit, "vibration [m/s2 or Pa]");
}

bool decode_taxels(ByteView rows, classifier::Trial& trial, TrialRecord& record) {
  LittleReader in(rows);
  while (in.remaining() > 0) {
    const auto t_ns = in.read<std::int64_t>();
    const auto device_us = in.read<std::uint32_t>();
    in.take(4);  // proximity and ambient light: stored in the campaign file, not used by
                 // classifiers
    const auto phase = phase_from_char(static_cast<char>(in.read<std::uint8_t>()));
    if (!phase.has_value()) return false;
    LittleReader counts(in.take(2 * trial.taxels));
    if (*phase == Phase::none) continue;
    record.t_ns.push_back(t_ns);
    record.device_us.push_back(device_us);
    trial.phase.push_back(*phase);
    for (std::size_t k = 0; k < trial.taxels; ++k)
      trial.counts.push_back(counts.read<std::uint16_t>());
  }
  return true;
}

void decode_wrench(ByteView rows, WrenchStream& stream) {
  LittleReader in(rows);
  while (in.remaining() > 0) {
    stream.t_ns.push_back(in.read<std::int64_t>());
    in.take(5);  // status word and validity: stored in the campaign file only
    for (int k = 0; k < 6; ++k) stream.quanta.push_back(in.read<std::int32_t>());
  }
}

void decode_stages(ByteView rows, std::size_t axes, StageStream& stream) {
  LittleReader in(rows);
  while (in.remaining() > 0) {
    stream.t_ns.push_back(in.read<std::int64_t>());
    for (std::size_t k = 0; k < axes; ++k) stream.quanta.push_back(in.read<std::int32_t>());
  }
}

void decode_blocks(ByteView rows, std::size_t values, std::uint32_t lost_before,
                   BlockStream& stream) {
  LittleReader in(rows);
  while (in.remaining() > 0) {
    stream.t_ns.push_back(in.read<std::int64_t>());
    stream.device_us.push_back(in.read<std::uint32_t>());
    stream.clipped.push_back(in.read<std::uint32_t>());
    stream.lost.push_back(std::exchange(lost_before, 0));
    for (std::size_t k = 0; k < values; ++k) stream.quanta.push_back(in.read<std::int32_t>());
  }
}

}  // namespace weft::daemon
