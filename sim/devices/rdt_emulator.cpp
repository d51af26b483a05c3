#include "sim/devices/rdt_emulator.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

/// Scale of the 16-bit counts of the command port: the rating just fits [E].
std::uint16_t scale_of(const FtSensorParams& sensor, std::size_t component) {
  const double counts = component < 3 ? sensor.counts_per_n : sensor.counts_per_nm;
  const double factor = std::ceil(sensor.range[component] * counts / 32767);
  return static_cast<std::uint16_t>(std::clamp(factor, 1.0, 65535.0));
}

std::uint32_t whole(double counts) {
  constexpr double most = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::clamp(std::round(counts), 0.0, most));
}

std::int16_t narrowed(std::int32_t counts, std::uint16_t scale) {
  const double narrow = std::round(static_cast<double>(counts) / scale);
  return static_cast<std::int16_t>(std::clamp(narrow, -32768.0, 32767.0));
}

}  // namespace

Result<ToolTransform> ToolTransform::create(const rdt::Configuration& of) {
  const auto metres = rdt::metres_per(static_cast<std::uint8_t>(of.distance_unit));
  if (!metres) return pass(metres.error());
  const auto radians = rdt::radians_per(static_cast<std::uint8_t>(of.angle_unit));
  if (!radians) return pass(radians.error());
  ToolTransform made;
  for (std::size_t i = 0; i < 3; ++i) {
    made.offset_m_[i] = of.tool_transform[i] * *metres;
    made.turn_rad_[i] = of.tool_transform[i + 3] * *radians;
  }
  return made;
}

Wrench ToolTransform::apply(const Wrench& sensed) const {
  if (none()) return sensed;
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Matrix3d frame =
      (AngleAxisd(turn_rad_[0], Vector3d::UnitX()) * AngleAxisd(turn_rad_[1], Vector3d::UnitY()) *
       AngleAxisd(turn_rad_[2], Vector3d::UnitZ()))
          .toRotationMatrix();
  const Vector3d force(sensed[0], sensed[1], sensed[2]);
  const Vector3d torque(sensed[3], sensed[4], sensed[5]);
  const Vector3d offset(offset_m_[0], offset_m_[1], offset_m_[2]);
  const Vector3d f = frame.transpose() * force;
  const Vector3d t = frame.transpose() * (torque - offset.cross(force));
  return {f.x(), f.y(), f.z(), t.x(), t.y(), t.z()};
}

RdtEmulator::RdtEmulator(const RdtEmulatorParams& params, BenchPlant& bench_plant,
                         std::uint64_t seed)
    : params_(params), bench_plant_(&bench_plant), sensor_(params.sensor, seed) {
  settings_.rate_hz = params.rate_hz;
  settings_.records_per_datagram = params.records_per_datagram;
}

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
    case rdt::RequestCommand::start_single:  // also at the stream's rate [E]
    case rdt::RequestCommand::start_realtime:
    case rdt::RequestCommand::start_buffered:
    case rdt::RequestCommand::start_multi_unit:  // with one unit the same as real time
      return start(*request, now);
    case rdt::RequestCommand::set_bias:
      return bias(now);
    case rdt::RequestCommand::reset_latch:
      return reset_latch();
    default:
      ++ignored_;
  }
}

void RdtEmulator::start(const rdt::Request& request, TimePoint now) {
  if (!settings_.rdt_enabled) return;
  streaming_ = true;
  stream_rate_hz_ = settings_.rate_hz;
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
  // Counted from the start each time: rates that do not divide a second do not drift.
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
  if (++taken_ % 2 == 0 && active_fault(FaultKind::rate_halved, at) != nullptr) return;
  apply_sequence_faults(at);
  ++sent_;
  const rdt::Record record = record_at(at);
  if (withheld(at)) return;
  rdt::append(buffer_, record);
  if (!buffered_ || buffer_.size() >= settings_.records_per_datagram * rdt::record_size) flush(out);
}

rdt::Record RdtEmulator::record_at(TimePoint at) {
  const std::uint32_t number = conversion_at(at);
  FtReading reading = sensor_.read(bench_plant_->contact(at), number, fz_off_n(at));
  apply_reading_faults(reading, at);
  rdt::Record record;
  record.rdt_sequence = sent_;
  record.ft_sequence = number;
  if (reading.saturated) record.status = rdt::status::summary | rdt::status::saturation;
  const double fz_n = reading.counts[2] / params_.sensor.counts_per_n;
  const std::array<std::int32_t, 6> counts = transformed(reading.counts);
  update_peaks(counts);
  const std::uint16_t breached = breached_by(counts);
  breached_ |= breached;
  latched_ = latched_ || (params_.threshold_n > 0 && std::abs(fz_n) > params_.threshold_n) ||
             breached != 0;
  if (latched_) record.status |= rdt::status::summary | rdt::status::monitor_condition;
  if (const Fault* bit = active_fault(FaultKind::status_bits, at))
    record.status |= rdt::status::summary | 1U << std::clamp(static_cast<int>(bit->amount), 0, 31);
  std::copy_n(counts.begin(), 3, record.force_counts.begin());
  std::copy_n(counts.begin() + 3, 3, record.torque_counts.begin());
  return record;
}

/// One bit for each threshold that is exceeded now. READFT and the pages enable their own
/// thresholds.
std::uint16_t RdtEmulator::breached_by(const std::array<std::int32_t, 6>& counts) const {
  unsigned out = 0;
  for (std::size_t i = 0; i < settings_.threshold.size(); ++i) {
    const rdt::Threshold& threshold = settings_.threshold[i];
    const bool is_request = (conditions_enabled_ >> i & 1) != 0;
    const bool enabled = is_request || (settings_.thresholds_enabled && threshold.enabled);
    if (!enabled || threshold.axis < 0) continue;
    const std::int32_t count = counts[static_cast<std::size_t>(threshold.axis)];
    if (threshold.comparison > 0 ? count > threshold.counts : count < threshold.counts)
      out |= 1U << i;
  }
  return static_cast<std::uint16_t>(out);
}

void RdtEmulator::update_peaks(const std::array<std::int32_t, 6>& counts) {
  if (!settings_.peak_logging) return;
  if (!highest_) highest_ = lowest_ = counts;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    (*highest_)[i] = std::max((*highest_)[i], counts[i]);
    (*lowest_)[i] = std::min((*lowest_)[i], counts[i]);
  }
}

void RdtEmulator::reset_latch() {
  latched_ = false;
  breached_ = 0;
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
  return active_fault(FaultKind::silent, at) != nullptr ||
         active_fault(FaultKind::redirected, at) != nullptr;
}

void RdtEmulator::apply_sequence_faults(TimePoint at) {
  if (const Fault* ahead = active_fault(FaultKind::sequence_jump, at); once(ahead, jumped_))
    sent_ += static_cast<std::uint32_t>(std::llround(ahead->amount));
  if (const Fault* back = active_fault(FaultKind::sequence_back, at); once(back, jumped_))
    sent_ -= static_cast<std::uint32_t>(std::llround(back->amount));
  if (once(active_fault(FaultKind::threshold_latch, at), latched_by_)) latched_ = true;
}

void RdtEmulator::apply_reading_faults(FtReading& reading, TimePoint at) {
  if (const double factor = calibration_factor(at); factor != 1)
    for (std::int32_t& counts : reading.counts) counts = nearest_count(counts * factor);
  if (active_fault(FaultKind::saturation, at) != nullptr) {
    reading.counts[2] = nearest_count(params_.sensor.range[2] * params_.sensor.counts_per_n);
    reading.saturated = true;
  }
  if (firing_fault(FaultKind::absurd_counts, at) != nullptr)
    reading.counts.fill(std::numeric_limits<std::int32_t>::max());
  hold_if_stuck(reading, at);
}

rdt::SettingsPage RdtEmulator::page(TimePoint now, std::optional<std::size_t> configuration) {
  const FtSensorParams& sensor = params_.sensor;
  const rdt::Record record = record_at(now);
  rdt::SettingsPage page;
  page.configuration = settings_.configuration[configuration.value_or(settings_.active)];
  page.active_configuration = settings_.active;
  page.force_unit = rdt::force_unit_name(page.configuration.force_unit);
  page.torque_unit = spelled_torque_unit(page.configuration.torque_unit);
  page.counts_per_force = counts_per_force(page.configuration, now);
  page.counts_per_torque = counts_per_torque(page.configuration, now);
  page.rdt_rate_hz = settings_.rate_hz;
  page.rdt_enabled = settings_.rdt_enabled;
  page.buffer_size = static_cast<std::uint32_t>(settings_.records_per_datagram);
  page.multi_unit = settings_.multi_unit;
  page.ethernet_ip = settings_.ethernet_ip;
  page.calibration_serial = calibration(now).serial;
  page.user_filter = settings_.user_filter;
  for (std::size_t i = 0; i < page.max_ratings.size(); ++i)
    page.max_ratings[i] = sensor.range[i] / (i < 3 ? rdt::newtons_per(page.force_unit)
                                                   : rdt::newton_metres_per(page.torque_unit))
                                                .value();
  page.bias_counts = sensor_.bias_counts();
  std::copy_n(record.force_counts.begin(), 3, page.counts.begin());
  std::copy_n(record.torque_counts.begin(), 3, page.counts.begin() + 3);
  page.peak_logging = settings_.peak_logging;
  page.highest_counts = highest_.value_or(page.highest_counts);
  page.lowest_counts = lowest_.value_or(page.lowest_counts);
  page.status = record.status;
  page.thresholds_enabled = settings_.thresholds_enabled;
  page.threshold = settings_.threshold;
  page.breached = breached_;
  for (std::size_t i = 0; i < settings_.threshold.size(); ++i)
    if ((breached_ >> i & 1) != 0) page.output_code |= settings_.threshold[i].output_code;
  page.latched = latched_;
  return page;
}

double RdtEmulator::counts_per_force(const rdt::Configuration& of, TimePoint now) const {
  const auto newtons = rdt::newtons_per(rdt::force_unit_name(of.force_unit));
  return std::round(params_.sensor.counts_per_n * calibration_factor(now) * newtons.value());
}

double RdtEmulator::counts_per_torque(const rdt::Configuration& of, TimePoint now) const {
  const auto newton_metres = rdt::newton_metres_per(rdt::torque_unit_name(of.torque_unit));
  return std::round(params_.sensor.counts_per_nm * calibration_factor(now) * newton_metres.value());
}

bool RdtEmulator::fits(const rdt::Configuration& configuration) const {
  constexpr double most = std::numeric_limits<std::uint32_t>::max();
  return counts_per_force(configuration, {}) <= most &&
         counts_per_torque(configuration, {}) <= most;
}

/// "N-m" or "Nm", and the other units accordingly, as the box's firmware spells them.
std::string RdtEmulator::spelled_torque_unit(unsigned code) const {
  std::string unit(rdt::torque_unit_name(code));
  const std::size_t newton = unit.find("Nm");
  if (newton != std::string::npos && params_.torque_unit == "N-m") unit.insert(newton + 1, "-");
  return unit;
}

rdt::CalibrationPage RdtEmulator::calibration(TimePoint now) const {
  const double factor = calibration_factor(now);
  rdt::CalibrationPage page{params_.calibration_serial + (factor == 1 ? "" : "x"),
                            params_.sensor.counts_per_n * factor,
                            params_.sensor.counts_per_nm * factor};
  page.torque_unit = params_.torque_unit;
  page.max_ratings = params_.sensor.range;
  page.part_number = "SI-40-2";
  page.date = "2026/01/01";
  return page;
}

NetftSettings RdtEmulator::settings() const {
  NetftSettings out = settings_;
  out.bias_counts = sensor_.bias_counts();
  return out;
}

void RdtEmulator::take(const NetftSettings& settings) {
  if (settings.peak_logging && !settings_.peak_logging) highest_ = lowest_ = std::nullopt;
  const auto before = std::exchange(settings_, settings);
  for (std::size_t i = 0; i < before.configuration.size(); ++i)
    if (!fits(settings_.configuration[i])) {
      settings_.configuration[i].force_unit = before.configuration[i].force_unit;
      settings_.configuration[i].torque_unit = before.configuration[i].torque_unit;
    }
  if (settings.bias_counts != sensor_.bias_counts()) sensor_.set_bias(settings.bias_counts);
  transform_ = ToolTransform::create(settings_.configuration[settings_.active]).value();
}

void RdtEmulator::bias(TimePoint now) {
  sensor_.bias(bench_plant_->contact(now), conversion_at(now), fz_off_n(now));
}

rdt::CalibrationReply RdtEmulator::calibration_reply(TimePoint now) const {
  const rdt::Configuration& active = settings_.configuration[settings_.active];
  rdt::CalibrationReply reply;
  reply.force_unit = static_cast<std::uint8_t>(active.force_unit);
  reply.torque_unit = static_cast<std::uint8_t>(active.torque_unit);
  reply.counts_per_force = whole(counts_per_force(active, now));
  reply.counts_per_torque = whole(counts_per_torque(active, now));
  for (std::size_t i = 0; i < reply.scale.size(); ++i) reply.scale[i] = scale_of(params_.sensor, i);
  return reply;
}

rdt::FtReply RdtEmulator::read_ft(const rdt::ReadFt& read, TimePoint now) {
  conditions_enabled_ = read.condition_mask;
  if (read.bias) bias(now);
  if (read.clear_latch) reset_latch();
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
  rdt::Configuration changed = settings_.configuration[settings_.active];
  changed.distance_unit = write.distance_unit;
  changed.angle_unit = write.angle_unit;
  for (std::size_t i = 0; i < changed.tool_transform.size(); ++i)
    changed.tool_transform[i] = write.hundredths[i] / 100.0;
  const auto made = ToolTransform::create(changed);
  if (!made) return pass(made.error());
  settings_.configuration[settings_.active] = std::move(changed);
  transform_ = *made;
  return {};
}

Status RdtEmulator::set_condition(const rdt::WriteCondition& write) {
  constexpr std::size_t reported_conditions = 32;
  if (write.index >= reported_conditions || write.axis > 5 || std::abs(write.comparison) != 1)
    return fail({.code = Errc::range,
                 .what = "threshold condition out of range",
                 .expected = "index 0 to 31, axis 0 to 5, comparison 1 or -1"});
  if (write.index >= settings_.threshold.size()) return {};
  rdt::Threshold& threshold = settings_.threshold[write.index];
  threshold.axis = write.axis;
  threshold.comparison = write.comparison > 0 ? 1 : -1;
  threshold.counts = write.compared_with * scale_of(params_.sensor, write.axis);
  threshold.output_code = write.output_code;
  return {};
}

void RdtEmulator::flush(ByteSink& out) {
  if (!buffer_.empty()) out(buffer_);
  buffer_.clear();
}

}  // namespace weft::sim
