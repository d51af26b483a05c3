#include "sim/devices/rdt_emulator.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

/// The box samples at 7 kHz whatever it sends [S: NETFTCPP]; its own count names each sample.
std::uint32_t internal_sample(TimePoint t) {
  constexpr std::int64_t rate_hz = 7000;
  const std::int64_t ns = t.time_since_epoch().count();
  return static_cast<std::uint32_t>(ns / 1'000'000'000 * rate_hz +
                                    ns % 1'000'000'000 * rate_hz / 1'000'000'000);
}

}  // namespace

RdtEmulator::RdtEmulator(const RdtEmulatorParams& params, BenchWorld& world, std::uint64_t seed)
    : params_(params), world_(&world), sensor_(params.sensor, seed) {}

void RdtEmulator::receive(ByteView datagram, TimePoint now, ByteSink& out) {
  wake(now, out);
  const auto request = rdt::decode_request(datagram);
  if (!request) {
    ++ignored_;
    return;
  }
  switch (request->command) {
    case rdt::RequestCommand::stop:
      return stop(out);
    case rdt::RequestCommand::start_realtime:
    case rdt::RequestCommand::start_buffered:
      return start(*request, now);
    case rdt::RequestCommand::set_bias:
      return sensor_.bias(world_->contact(now), internal_sample(now));
    case rdt::RequestCommand::reset_latch:
      return;  // no threshold is ever latched here
    default:
      ++ignored_;
  }
}

void RdtEmulator::start(const rdt::Request& request, TimePoint now) {
  streaming_ = true;
  buffered_ = request.command == rdt::RequestCommand::start_buffered;
  wanted_ = request.sample_count;
  sent_ = 0;
  started_ = now;
  buffer_.clear();
}

void RdtEmulator::stop(ByteSink& out) {
  flush(out);
  streaming_ = false;
}

TimePoint RdtEmulator::sample_time(std::uint64_t sample) const {
  // From the start each time, so that rates that do not divide a second do not drift.
  return started_ + from_seconds(static_cast<double>(sample) / params_.rate_hz);
}

std::optional<TimePoint> RdtEmulator::next_wakeup() const {
  if (!streaming_) return std::nullopt;
  return sample_time(sent_);
}

void RdtEmulator::wake(TimePoint now, ByteSink& out) {
  while (streaming_ && sample_time(sent_) <= now) {
    sample(sample_time(sent_), out);
    if (wanted_ != 0 && sent_ >= wanted_) stop(out);
  }
}

void RdtEmulator::sample(TimePoint at, ByteSink& out) {
  const std::uint32_t number = internal_sample(at);
  const FtReading reading = sensor_.read(world_->contact(at), number);
  rdt::Record record;
  record.rdt_sequence = static_cast<std::uint32_t>(++sent_);
  record.ft_sequence = number;
  if (reading.saturated) record.status = rdt::status::summary | rdt::status::saturation;
  std::copy_n(reading.counts.begin(), 3, record.force_counts.begin());
  std::copy_n(reading.counts.begin() + 3, 3, record.torque_counts.begin());
  rdt::append(buffer_, record);
  if (!buffered_ || buffer_.size() >= params_.records_per_datagram * rdt::record_size) flush(out);
}

void RdtEmulator::flush(ByteSink& out) {
  if (!buffer_.empty()) out(buffer_);
  buffer_.clear();
}

}  // namespace weft::sim
