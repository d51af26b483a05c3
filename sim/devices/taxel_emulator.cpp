#include "sim/devices/taxel_emulator.hpp"

#include <algorithm>

#include "protocols/taxel/taxel.hpp"

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

TaxelEmulator::TaxelEmulator(const TaxelEmulatorParams& params, BenchPlant& bench_plant,
                             TimePoint now)
    : FrameEmulator(now, params.largest_chunk_bytes, params.chunk_seed),
      params_(params),
      bench_plant_(&bench_plant),
      next_frame_(
          (static_cast<std::uint64_t>(now.time_since_epoch().count() + params.period_ns - 1)) /
          static_cast<std::uint64_t>(params.period_ns)) {
  if (!params.places.empty())
    resampler_.emplace(params.places, params.noise_counts, mix(params.chunk_seed, "taxels"));
}

TimePoint TaxelEmulator::frame_start(std::uint64_t frame) const {
  return TimePoint(Duration(static_cast<std::int64_t>(frame) * params_.period_ns));
}

std::optional<TimePoint> TaxelEmulator::next_wakeup() const {
  return frame_start(next_frame_ + 1);
}

void TaxelEmulator::skip_to(TimePoint now) {
  dead_counts_.reset();
  frozen_.reset();
  for (; *next_wakeup() < now; ++next_frame_, ++sequence_)
    if (params_.wire == TaxelWire::weft) pass_over(protocols::taxel::frame_size(taxels()));
}

void TaxelEmulator::act(TimePoint at, ByteSink& out) {
  if (withheld(next_frame_++, at)) return;
  apply_number_faults(at);
  const PadFrame& scan = bench_plant_->frame(at);
  const Light light = light_at(-bench_plant_->plant().contact().indentation_m);
  protocols::taxel::Frame frame;
  frame.sequence = sequence_++;
  frame.device_us = clock_us(at, at);
  frame.taxel_count = static_cast<std::uint8_t>(taxels());
  if (resampler_)
    resampler_->sample(scan, at, next_frame_, std::span(frame.counts).first(taxels()));
  else
    std::copy(scan.counts.begin(), scan.counts.end(), frame.counts.begin());
  frame.proximity_counts = light.proximity_counts;
  frame.ambient_counts = light.ambient_counts;
  apply_faults(frame, at);
  if (params_.wire == TaxelWire::cpm_udp) {
    protocols::taxel::cpm::Counts counts{};
    std::copy_n(frame.counts.begin(), counts.size(), counts.begin());
    const auto datagram = protocols::taxel::cpm::encode_datagram(counts);
    const std::size_t reported_bytes = sizeof(std::uint16_t) * frame.taxel_count;
    return out(ByteView(datagram).first(std::min(reported_bytes, datagram.size())));
  }
  send(frame, at, out);
}

void TaxelEmulator::apply_number_faults(TimePoint at) {
  sequence_ = static_cast<std::uint16_t>(sequence_ + number_jump(at));
  if (restarts(at)) sequence_ = 0;
}

void TaxelEmulator::apply_faults(protocols::taxel::Frame& frame, TimePoint at) {
  apply_pad_faults(frame, at);
  if (frozen(FaultKind::frozen_frame, at, frame, frozen_)) frame.counts = frozen_->counts;
  if (const Fault* wrong = active_fault(FaultKind::wrong_count, at))
    frame.taxel_count = static_cast<std::uint8_t>(
        std::clamp(wrong->amount, 1.0, double{protocols::taxel::max_taxels}));
}

void TaxelEmulator::apply_pad_faults(protocols::taxel::Frame& frame, TimePoint at) {
  constexpr double noise_counts = 3000;
  const auto pad = [&](const Fault* fault) -> std::uint16_t& {
    return frame.counts[static_cast<std::size_t>(
        std::clamp(fault->amount, 0.0, static_cast<double>(taxels() - 1)))];
  };
  const Fault* dead = active_fault(FaultKind::dead_pad, at);
  if (frozen(FaultKind::dead_pad, at, dead != nullptr ? pad(dead) : std::uint16_t{0}, dead_counts_))
    pad(dead) = *dead_counts_;
  if (const Fault* full = active_fault(FaultKind::saturated_pad, at)) pad(full) = 0xFFFF;
  if (const Fault* noisy = firing_fault(FaultKind::noisy_pad, at))
    pad(noisy) = quantise(pad(noisy) + noise_counts * fault_dice().gaussian());
}

}  // namespace weft::sim
