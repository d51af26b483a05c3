#include "sim/devices/vibro_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft::sim {

namespace vibro = protocols::vibro;

namespace {

/// Delay from a block's last reading to its frame on the wire [E]. It is longer than the longest
/// step of the plant's grid (3.072 ms), so that the readings exist.
constexpr Duration block_latency = std::chrono::milliseconds(4);
constexpr double micro_per_unit = 1e6;

vibro::ChannelDescription description_of(const VibroChannelParams& channel) {
  if (channel.period_ns == 0) return {};
  return {
      .rate_mhz =
          static_cast<std::uint32_t>(std::llround(1e12 / static_cast<double>(channel.period_ns))),
      .range_micro = static_cast<std::uint32_t>(std::llround(channel.range * micro_per_unit)),
      .full_scale_counts = static_cast<std::uint16_t>(std::lround(channel.range / channel.quantum)),
      .block_readings = channel.block_readings};
}

constexpr std::size_t frame_bytes(std::size_t body_bytes) {
  return FrameHead::size + body_bytes + FrameHead::tail_size;
}

std::int16_t counts_of(double value, double quantum) {
  using Counts = std::numeric_limits<std::int16_t>;
  return static_cast<std::int16_t>(
      std::clamp<double>(std::round(value / quantum), Counts::min(), Counts::max()));
}

}  // namespace

TimePoint VibroEmulator::Channel::due() const {
  const std::uint64_t last = (next_block + 1) * params.block_readings - 1;
  return TimePoint(Duration(static_cast<std::int64_t>(last) * params.period_ns)) + block_latency;
}

void VibroEmulator::Channel::drop_old() {
  for (; !waiting.empty() && first_index < first_of_next(); ++first_index) waiting.pop_front();
}

VibroEmulator::VibroEmulator(const VibroEmulatorParams& params, BenchPlant& bench_plant,
                             TimePoint now)
    : FrameEmulator(now, params.datagrams ? 0 : params.largest_chunk_bytes, params.chunk_seed),
      params_(params),
      bench_plant_(&bench_plant),
      next_description_(now) {
  channels_[0].kind = vibro::Kind::acceleration;
  channels_[0].params = params.acceleration;
  channels_[1].kind = vibro::Kind::sound;
  channels_[1].params = params.sound;
  for (Channel& channel : channels_) {
    if (!channel.on()) continue;
    const std::int64_t block_ns = channel.params.period_ns * channel.params.block_readings;
    channel.next_block = static_cast<std::uint64_t>(ns_of(now) / block_ns + 1);
  }
}

std::optional<TimePoint> VibroEmulator::next_wakeup() const {
  TimePoint next = next_description_;
  for (const Channel& channel : channels_)
    if (channel.on()) next = std::min(next, channel.due());
  return next;
}

void VibroEmulator::skip_to(TimePoint now) {
  for (TimePoint at = *next_wakeup(); at < now; at = *next_wakeup()) {
    if (next_description_ == at) {
      next_description_ += description_period;
      ++descriptions_;
      pass_over(frame_bytes(vibro::description_size));
    }
    for (Channel& channel : channels_) {
      if (!channel.on() || channel.due() != at) continue;
      ++channel.next_block;
      ++channel.sequence;
      pass_over(frame_bytes(sizeof(std::int16_t) * vibro::values_per_reading(channel.kind) *
                            channel.params.block_readings));
    }
  }
  listen(now);
  for (Channel& channel : channels_) {
    channel.frozen.reset();
    channel.drop_old();
  }
}

void VibroEmulator::act(TimePoint at, ByteSink& out) {
  apply_number_faults(at);
  if (next_description_ == at) send_description(at, out);
  for (Channel& channel : channels_)
    if (channel.on() && channel.due() == at) send_block(channel, at, out);
}

void VibroEmulator::send_description(TimePoint at, ByteSink& out) {
  next_description_ += description_period;
  if (active_fault(FaultKind::silent, at) != nullptr) return;
  vibro::Frame frame;
  frame.sequence = descriptions_++;
  frame.device_us = clock_us(at, at);
  frame.description = {.serial = params_.serial,
                       .firmware = params_.firmware,
                       .acceleration = description_of(params_.acceleration),
                       .sound = description_of(params_.sound)};
  send(frame, at, out);
}

/// Takes the readings of the plant. A gap would begin a new run; a plant with a listener makes
/// none.
void VibroEmulator::listen(TimePoint now) {
  const VibrationReadings readings = bench_plant_->extract_vibration(now);
  const auto add = [](Channel& channel, std::uint64_t index, const Reading& reading) {
    if (index != channel.first_index + channel.waiting.size()) {
      channel.waiting.clear();
      channel.first_index = index;
    }
    channel.waiting.push_back(reading);
  };
  for (const AccelerationReading& r : readings.acceleration)
    add(channels_[0], r.index, r.acceleration_mps2);
  for (const SoundReading& r : readings.sound) add(channels_[1], r.index, {r.pressure_pa, 0, 0});
}

void VibroEmulator::send_block(Channel& channel, TimePoint at, ByteSink& out) {
  listen(at);
  channel.drop_old();
  const std::uint64_t first = channel.first_of_next(), size = channel.params.block_readings;
  const std::uint64_t number = channel.next_block++;
  if (channel.first_index != first || channel.waiting.size() < size) return;
  vibro::Frame frame;
  frame.kind = channel.kind;
  const std::size_t axes = vibro::values_per_reading(channel.kind);
  for (std::size_t i = 0; i < size; ++i, ++channel.first_index) {
    for (std::size_t axis = 0; axis < axes; ++axis)
      frame.values[frame.value_count++] =
          counts_of(channel.waiting.front()[axis], channel.params.quantum);
    channel.waiting.pop_front();
  }
  if (withheld(number, at)) return;
  frame.sequence = channel.sequence++;
  frame.device_us = clock_us(
      TimePoint(Duration(static_cast<std::int64_t>(first) * channel.params.period_ns)), at);
  apply_faults(channel, frame, at);
  send(frame, at, out);
}

void VibroEmulator::apply_number_faults(TimePoint at) {
  const std::int64_t jump = number_jump(at);
  for (Channel& channel : channels_)
    channel.sequence = static_cast<std::uint16_t>(channel.sequence + jump);
  if (!restarts(at)) return;
  for (Channel& channel : channels_) channel.sequence = 0;
  next_description_ = at;
}

void VibroEmulator::apply_faults(Channel& channel, vibro::Frame& frame, TimePoint at) {
  const std::size_t axes = vibro::values_per_reading(channel.kind);
  frozen(FaultKind::frozen_frame, at, {frame.values[0], frame.values[1], frame.values[2]},
         channel.frozen);
  const std::int16_t full = counts_of(channel.params.range, channel.params.quantum);
  const bool saturated = active_fault(FaultKind::saturation, at) != nullptr;
  for (std::size_t i = 0; i < frame.value_count; ++i) {
    if (channel.frozen) frame.values[i] = (*channel.frozen)[i % axes];
    if (saturated) frame.values[i] = full;
  }
  if (const Fault* wrong = active_fault(FaultKind::wrong_count, at))
    frame.value_count = static_cast<std::uint16_t>(
        static_cast<double>(axes) *
        std::floor(std::clamp(wrong->amount, 1.0, static_cast<double>(vibro::max_values / axes))));
}

}  // namespace weft::sim
