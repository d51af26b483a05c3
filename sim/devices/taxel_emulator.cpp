#include "sim/devices/taxel_emulator.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {

namespace {

// A VCNL4000 that looks down past the pads; shapes and levels [E].
constexpr double proximity_far_counts = 2000;
constexpr double proximity_range_counts = 60000;
constexpr double proximity_half_m = 3e-3;  // height at which the reflection has halved
constexpr double ambient_open_counts = 900;
constexpr double ambient_closed_counts = 60;

struct Light {
  std::uint16_t proximity_counts, ambient_counts;
};

Light light_at(double height_m) {
  const double ratio = std::max(height_m, 0.0) / proximity_half_m;
  const double reflected = 1 / (1 + ratio * ratio);
  return {
      quantise(proximity_far_counts + proximity_range_counts * reflected),
      quantise(ambient_open_counts + (ambient_closed_counts - ambient_open_counts) * reflected)};
}

}  // namespace

TaxelEmulator::TaxelEmulator(const TaxelEmulatorParams& params, BenchWorld& world, TimePoint now)
    : params_(params),
      world_(&world),
      power_on_(now),
      next_frame_(BenchWorld::frame_at_or_after(now)),
      chunks_(params.chunk_seed) {}

void TaxelEmulator::receive(ByteView, TimePoint now, ByteSink& out) {
  wake(now, out);
}

std::optional<TimePoint> TaxelEmulator::next_wakeup() const {
  return BenchWorld::frame_start(next_frame_ + 1);
}

void TaxelEmulator::wake(TimePoint now, ByteSink& out) {
  for (TimePoint at = *next_wakeup(); at <= now; at = *next_wakeup()) send_frame(at, out);
}

void TaxelEmulator::send_frame(TimePoint at, ByteSink& out) {
  const PadFrame& scan = world_->frame(at);
  const Light light = light_at(-world_->plant().contact().indentation_m);
  protocols::taxel::Frame frame;
  frame.sequence = sequence_++;
  frame.device_us = static_cast<std::uint32_t>((at - power_on_).count() / 1000);
  frame.taxel_count = static_cast<std::uint8_t>(pad_count);
  std::copy(scan.counts.begin(), scan.counts.end(), frame.counts.begin());
  frame.proximity_counts = light.proximity_counts;
  frame.ambient_counts = light.ambient_counts;
  buffer_.clear();
  protocols::taxel::append(buffer_, frame);
  ++next_frame_;
  send(buffer_, out);
}

void TaxelEmulator::send(ByteView bytes, ByteSink& out) {
  if (params_.largest_chunk_bytes == 0) return out(bytes);
  while (!bytes.empty()) {
    const std::size_t wanted = 1 + chunks_.bits() % params_.largest_chunk_bytes;
    const ByteView chunk = bytes.first(std::min(wanted, bytes.size()));
    bytes = bytes.subspan(chunk.size());
    out(chunk);
  }
}

}  // namespace weft::sim
