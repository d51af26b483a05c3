#include "sim/devices/rdt_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

/// What the 16-bit counts of the command port are multiplied by: the rating just fits [E].
std::uint16_t scale_of(const FtSensorParams& sensor, std::size_t component) {
  const double counts = component < 3 ? sensor.counts_per_n : sensor.counts_per_nm;
  const double factor = std::ceil(sensor.range[component] * counts / 32767);
  return static_cast<std::uint16_t>(std::clamp(factor, 1.0, 65535.0));
}

std::int16_t narrowed(std::int32_t counts, std::uint16_t scale) {
  const double narrow = std::round(static_cast<double>(counts) / scale);
  return static_cast<std::int16_t>(std::clamp(narrow, -32768.0, 32767.0));
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
    case rdt::RequestCommand::start_multi_unit:  // of one unit: as in real time
      return start(*request, now);
    case rdt::RequestCommand::set_bias:
      return sensor_.bias(world_->contact(now), conversion_at(now));
    case rdt::RequestCommand::reset_latch:
      latched_ = false;
      return;
    default:
      ++ignored_;
  }
}

void RdtEmulator::start(const rdt::Request& request, TimePoint now) {
  if (!rdt_enabled_) return;
  streaming_ = true;
  stream_rate_hz_ = params_.rate_hz;
  buffered_ = request.command == rdt::RequestCommand::start_buffered;
  wanted_ = request.sample_count;
  taken_ = 0;
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
  return started_ + from_seconds(static_cast<double>(sample) / stream_rate_hz_);
}

std::optional<TimePoint> RdtEmulator::next_wakeup() const {
  if (!streaming_) return std::nullopt;
  return sample_time(taken_);
}

void RdtEmulator::wake(TimePoint now, ByteSink& out) {
  while (streaming_ && sample_time(taken_) <= now) {
    sample(sample_time(taken_), out);
    if (wanted_ != 0 && taken_ >= wanted_) stop(out);
  }
}

void RdtEmulator::sample(TimePoint at, ByteSink& out) {
  if (++taken_ % 2 == 0 && suffers(FaultKind::rate_halved, at) != nullptr) return;
  suffer_sequence(at);
  ++sent_;
  const rdt::Record record = record_at(at);
  if (withheld(at)) return;
  rdt::append(buffer_, record);
  if (!buffered_ || buffer_.size() >= params_.records_per_datagram * rdt::record_size) flush(out);
}

rdt::Record RdtEmulator::record_at(TimePoint at) {
  const std::uint32_t number = conversion_at(at);
  FtReading reading = sensor_.read(world_->contact(at), number);
  suffer_reading(reading, at);
  rdt::Record record;
  record.rdt_sequence = sent_;
  record.ft_sequence = number;
  if (reading.saturated) record.status = rdt::status::summary | rdt::status::saturation;
  const double fz_n = reading.counts[2] / params_.sensor.counts_per_n;
  const std::array<std::int32_t, 6> counts = transformed(reading.counts);
  latched_ = latched_ || (params_.threshold_n > 0 && std::abs(fz_n) > params_.threshold_n) ||
             condition_met(counts);
  if (latched_) record.status |= rdt::status::summary | rdt::status::monitor_condition;
  if (const Fault* bit = suffers(FaultKind::status_bits, at))
    record.status |= rdt::status::summary | 1U << std::clamp(static_cast<int>(bit->amount), 0, 31);
  std::copy_n(counts.begin(), 3, record.force_counts.begin());
  std::copy_n(counts.begin() + 3, 3, record.torque_counts.begin());
  return record;
}

bool RdtEmulator::condition_met(const std::array<std::int32_t, 6>& counts) const {
  for (std::size_t i = 0; i < 16; ++i) {
    const std::optional<rdt::WriteCondition>& condition = conditions_[i];
    if (!condition || (conditions_enabled_ >> i & 1) == 0) continue;
    const std::int64_t limit =
        std::int64_t{condition->compared_with} * scale_of(params_.sensor, condition->axis);
    const std::int64_t told = counts[condition->axis];
    if (condition->comparison > 0 ? told > limit : told < limit) return true;
  }
  return false;
}

std::array<std::int32_t, 6> RdtEmulator::transformed(
    const std::array<std::int32_t, 6>& counts) const {
  if (transform_.none()) return counts;
  const auto scale = [&](std::size_t i) {
    return i < 3 ? params_.sensor.counts_per_n : params_.sensor.counts_per_nm;
  };
  Wrench wrench{};
  for (std::size_t i = 0; i < wrench.size(); ++i) wrench[i] = counts[i] / scale(i);
  wrench = transform_.apply(wrench);
  std::array<std::int32_t, 6> out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = nearest_count(wrench[i] * scale(i));
  return out;
}

bool RdtEmulator::withheld(TimePoint at) const {
  return suffers(FaultKind::silent, at) != nullptr || suffers(FaultKind::redirected, at) != nullptr;
}

void RdtEmulator::suffer_sequence(TimePoint at) {
  if (const Fault* ahead = suffers(FaultKind::sequence_jump, at); once(ahead, jumped_))
    sent_ += static_cast<std::uint32_t>(std::llround(ahead->amount));
  if (const Fault* back = suffers(FaultKind::sequence_back, at); once(back, jumped_))
    sent_ -= static_cast<std::uint32_t>(std::llround(back->amount));
  if (once(suffers(FaultKind::threshold_latch, at), latched_by_)) latched_ = true;
}

void RdtEmulator::suffer_reading(FtReading& reading, TimePoint at) {
  const double scale = params_.sensor.counts_per_n;
  if (const double off_n = fz_off_n(at); off_n != 0)
    reading.counts[2] = nearest_count(reading.counts[2] + off_n * scale);
  if (const double factor = calibration_factor(at); factor != 1)
    for (std::int32_t& counts : reading.counts) counts = nearest_count(counts * factor);
  if (suffers(FaultKind::saturation, at) != nullptr) {
    reading.counts[2] = nearest_count(params_.sensor.range[2] * scale);
    reading.saturated = true;
  }
  if (struck_by(FaultKind::absurd_counts, at) != nullptr)
    reading.counts.fill(std::numeric_limits<std::int32_t>::max());
  hold_if_stuck(reading, at);
}

rdt::SettingsPage RdtEmulator::settings(TimePoint now) {
  const FtSensorParams& sensor = params_.sensor;
  const rdt::Record record = record_at(now);
  rdt::SettingsPage page;
  page.counts_per_force = sensor.counts_per_n * calibration_factor(now);
  page.counts_per_torque = sensor.counts_per_nm * calibration_factor(now);
  page.rdt_rate_hz = params_.rate_hz;
  page.rdt_enabled = rdt_enabled_;
  page.calibration_serial = calibration(now).serial;
  page.user_filter = user_filter_;
  page.torque_unit = params_.torque_unit;
  page.max_ratings = sensor.range;
  page.bias_counts = sensor_.bias_counts();
  std::copy_n(record.force_counts.begin(), 3, page.counts.begin());
  std::copy_n(record.torque_counts.begin(), 3, page.counts.begin() + 3);
  page.tool_transform = transform_.told();
  page.status = record.status;
  page.buffer_size = static_cast<std::uint32_t>(params_.records_per_datagram);
  return page;
}

rdt::CalibrationPage RdtEmulator::calibration(TimePoint now) const {
  const double factor = calibration_factor(now);
  return {params_.calibration_serial + (factor == 1 ? "" : "x"),
          params_.sensor.counts_per_n * factor, params_.sensor.counts_per_nm * factor};
}

rdt::CalibrationReply RdtEmulator::calibration_reply(TimePoint now) const {
  const double factor = calibration_factor(now);
  const FtSensorParams& sensor = params_.sensor;
  rdt::CalibrationReply reply;
  reply.counts_per_force = static_cast<std::uint32_t>(std::llround(sensor.counts_per_n * factor));
  reply.counts_per_torque = static_cast<std::uint32_t>(std::llround(sensor.counts_per_nm * factor));
  for (std::size_t i = 0; i < reply.scale.size(); ++i) reply.scale[i] = scale_of(sensor, i);
  return reply;
}

rdt::FtReply RdtEmulator::read_ft(const rdt::ReadFt& read, TimePoint now) {
  conditions_enabled_ = read.condition_mask;
  if (read.bias) sensor_.bias(world_->contact(now), conversion_at(now));
  if (read.clear_latch) latched_ = false;
  const rdt::Record record = record_at(now);
  rdt::FtReply reply;
  reply.status = static_cast<std::uint16_t>(record.status >> 16);
  for (std::size_t i = 0; i < reply.counts.size(); ++i) {
    const std::int32_t counts = i < 3 ? record.force_counts[i] : record.torque_counts[i - 3];
    reply.counts[i] = narrowed(counts, scale_of(params_.sensor, i));
  }
  return reply;
}

Status RdtEmulator::set_transform(const rdt::WriteTransform& write) {
  const auto made = ToolTransform::create(write);
  if (!made) return pass(made.error());
  transform_ = *made;
  return {};
}

Status RdtEmulator::set_condition(const rdt::WriteCondition& write) {
  if (write.index >= conditions_.size() || write.axis > 5 || std::abs(write.comparison) != 1)
    return fail(Errc::range, "no such threshold condition", {},
                "index 0 to 31, axis 0 to 5, comparison 1 or -1");
  conditions_[write.index] = write;
  return {};
}

void RdtEmulator::set_rate_hz(double rate_hz) {
  constexpr double conversions_hz = 7000;
  params_.rate_hz = conversions_hz / std::max(1.0, std::floor(conversions_hz / rate_hz));
}

void RdtEmulator::flush(ByteSink& out) {
  if (!buffer_.empty()) out(buffer_);
  buffer_.clear();
}

}  // namespace weft::sim
