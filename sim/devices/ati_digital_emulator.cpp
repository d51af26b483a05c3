#include "sim/devices/ati_digital_emulator.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace weft::sim {
namespace {

namespace digital = protocols::ati_digital;
using namespace protocols::modbus;
using protocols::modbus::Reply;

/// A request ends when the line has been silent for this time. On a wire 3.5 characters are enough,
/// but an operating system may delay the second half of a write for longer.
constexpr Duration silence = std::chrono::milliseconds(20);
/// Silence has no meaning on TCP; this is the longest wait for the rest of a request.
constexpr Duration partial_request_timeout = std::chrono::milliseconds(500);

/// Here only the converter of the gauges limits and quantises.
FtSensorParams unlimited(FtSensorParams params) {
  params.range.fill(std::numeric_limits<double>::infinity());
  params.quantum.fill(0);
  return params;
}

std::array<std::array<double, 6>, digital::gauges> inverse(const digital::Calibration& c) {
  Eigen::Matrix<double, 6, 6> matrix;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t g = 0; g < 6; ++g)
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(g)) = double{c.matrix[i][g]};
  const Eigen::Matrix<double, 6, 6> inverted = matrix.inverse();
  std::array<std::array<double, 6>, digital::gauges> out{};
  for (std::size_t g = 0; g < 6; ++g)
    for (std::size_t i = 0; i < 6; ++i)
      out[g][i] = inverted(static_cast<Eigen::Index>(g), static_cast<Eigen::Index>(i));
  return out;
}

std::int16_t held(double counts) {
  constexpr double lowest = std::numeric_limits<std::int16_t>::min();
  constexpr double highest = std::numeric_limits<std::int16_t>::max();
  return static_cast<std::int16_t>(std::clamp(std::round(counts), lowest, highest));
}

ExceptionCode code_for(const Error& error) {
  return error.code == Errc::unsupported ? ExceptionCode::illegal_function
                                         : ExceptionCode::illegal_value;
}

std::uint8_t code_of(Function function) {
  return static_cast<std::uint8_t>(function);
}

/// Another calibration in the sensor, visible by its serial number and its scale.
digital::Calibration changed(digital::Calibration calibration, double factor) {
  constexpr std::size_t longest_serial = 8;
  calibration.serial = calibration.serial.substr(0, longest_serial - 1) + "x";
  calibration.counts_per_force =
      static_cast<std::int32_t>(std::lround(calibration.counts_per_force * factor));
  calibration.counts_per_torque =
      static_cast<std::int32_t>(std::lround(calibration.counts_per_torque * factor));
  return calibration;
}

using namespace protocols::ati_digital;
using protocols::modbus::ExceptionCode;

constexpr double rated_counts = 10000;
constexpr std::array<float, 6> rating{40, 40, 120, 2, 2, 2};  // SI-40-2, N and N m

/// Serial FT12288, rows Fx Fy Fz Tx Ty Tz, columns gauges 0 to 5 (CAL80: device-facts.md,
/// Sources).
Eigen::Matrix<double, 6, 6> real_pattern() {
  Eigen::Matrix<double, 6, 6> pattern;
  pattern << 0.49669, -0.30752, -0.67526, 31.58401, -0.52567, -32.13403,  //
      0.91512, -37.57532, -0.01988, 17.91305, 0.26027, 18.99891,          //
      18.30062, -0.22759, 18.41379, -0.40968, 18.58899, -0.15117,         //
      0.26910, -0.13463, 32.49482, -0.24474, -32.11057, -0.15796,         //
      -36.63785, 0.16587, 18.24145, -0.39863, 19.10634, 0.16747,          //
      0.78551, -18.83761, 0.00110, -18.39501, -0.10621, -18.71622;
  return pattern;
}

bool writable(std::size_t address) {
  return address <= holding::session_id || address == holding::baud_is_non_volatile ||
         address == holding::baud_index;
}

}  // namespace

AtiDigitalEmulator::AtiDigitalEmulator(const AtiDigitalParams& params, BenchPlant& bench_plant,
                                       std::uint64_t seed)
    : params_(params),
      bench_plant_(&bench_plant),
      sensor_(unlimited(params.sensor), seed),
      calibration_(mini40_calibration(params.serial, params.sensor.counts_per_n,
                                      params.sensor.counts_per_nm)),
      gauges_per_count_(inverse(calibration_)),
      registers_(calibration_, params.calibration, params.status_word),
      rtu_(Side::requests, params.slave) {}

void AtiDigitalEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  wake(now, out);
  if (params_.echo) out(bytes);
  if (now - received_at_ > (params_.modbus_tcp ? partial_request_timeout : silence))
    discard_partial();
  received_at_ = now;
  if (params_.modbus_tcp) return serve_tcp(bytes, now, out);
  if (!streaming_) return serve_rtu(bytes, now, out);
  jam_bytes_ += bytes.size();
  streaming_ = jam_bytes_ < digital::jam_size;
}

void AtiDigitalEmulator::discard_partial() {
  rtu_.clear();
  tcp_.clear();
  jam_bytes_ = 0;
}

void AtiDigitalEmulator::serve_rtu(ByteView bytes, TimePoint now, ByteSink& out) {
  rtu_.push(bytes);
  while (const std::optional<ByteView> pdu = rtu_.next()) {
    const Reply reply = answer(*pdu, now);
    if (rtu_.to_all()) continue;  // executed, but a broadcast is not answered
    buffer_.clear();
    append_rtu(buffer_, params_.slave, reply);
    if (firing_fault(FaultKind::crc_errors, now) != nullptr) buffer_.back() ^= 0x55;
    out(buffer_);
  }
}

void AtiDigitalEmulator::serve_tcp(ByteView bytes, TimePoint now, ByteSink& out) {
  tcp_.push(bytes);
  while (const std::optional<MbapFrame> frame = tcp_.next()) {
    // 0 and 255 address the device at this IP address itself (Modbus messaging on TCP/IP,
    // implementation guide, "unit identifier").
    const bool ours = frame->unit == params_.slave || frame->unit == 0 || frame->unit == 255;
    const std::uint8_t function = frame->pdu.empty() ? std::uint8_t{0} : frame->pdu[0];
    buffer_.clear();
    append_mbap(buffer_, frame->transaction, frame->unit,
                ours ? answer(frame->pdu, now)
                     : Reply(Exception{function, ExceptionCode::gateway_target_silent}));
    out(buffer_);
  }
}

Reply AtiDigitalEmulator::answer(ByteView pdu, TimePoint now) {
  if (active_fault(FaultKind::wrong_reply, now) != nullptr)
    return ReadReply{Function::read_input, Registers(std::array<std::uint16_t, 1>{})};
  const Result<Request> request = decode_request(pdu);
  if (!request) return Exception{pdu.empty() ? std::uint8_t{0} : pdu[0], code_for(request.error())};
  if (const auto* r = std::get_if<Read>(&*request)) return read(*r, now);
  if (const auto* w = std::get_if<WriteOne>(&*request))
    return write(w->address, std::span(&w->value, 1), *w);
  if (const auto* w = std::get_if<WriteMany>(&*request))
    return write(w->address, w->registers.view(), WroteMany{w->address, w->registers.count});
  return execute_vendor_order(std::get<Vendor>(*request), now);
}

Reply AtiDigitalEmulator::read_holding(const Read& read, TimePoint now) const {
  ReadReply reply{read.function, {}};
  const double factor = calibration_factor(now);
  const bool other = factor != 1 && read.address >= digital::holding::first_calibration;
  const auto problem = other
                           ? DigitalRegisters(changed(calibration_, factor), params_.calibration, 0)
                                 .read_holding(read.address, read.count, reply.registers)
                           : registers_.read_holding(read.address, read.count, reply.registers);
  if (problem) return Exception{code_of(read.function), *problem};
  const std::size_t status = digital::holding::status;
  if (read.address <= status && status < std::size_t{read.address} + read.count)
    reply.registers.values[status - read.address] = status_word(now);
  return reply;
}

Reply AtiDigitalEmulator::read(const Read& read, TimePoint now) {
  if (read.function == Function::read_holding) return read_holding(read, now);
  const Exception refused{code_of(read.function), ExceptionCode::illegal_address};
  ReadReply reply{read.function, {}};
  constexpr std::size_t inputs = digital::input::diagnostics + 6;
  if (std::size_t{read.address} + read.count > inputs) return refused;
  std::array<std::uint16_t, inputs> values{};
  const GaugeCounts counts = convert(now);
  std::copy(counts.begin(), counts.end(), values.begin());
  reply.registers = Registers(std::span(values).subspan(read.address, read.count));
  return reply;
}

Reply AtiDigitalEmulator::write(std::uint16_t address, std::span<const std::uint16_t> values,
                                const Reply& done) {
  const auto problem = registers_.write(address, values);
  if (!problem) return done;
  const bool one = std::holds_alternative<WriteOne>(done);
  return Exception{code_of(one ? Function::write_one : Function::write_many), *problem};
}

Reply AtiDigitalEmulator::execute_vendor_order(const Vendor& order, TimePoint now) {
  constexpr std::uint8_t refused = 0;
  if (order.function == Function::vendor_lock) {
    const bool known = order.data == digital::lock || order.data == digital::unlock;
    if (known) registers_.lock(order.data == digital::lock);
    return Vendor{order.function, known ? digital::done : refused};
  }
  if (params_.modbus_tcp)
    return Exception{code_of(order.function), ExceptionCode::illegal_function};
  if (order.data != digital::start_stream) return Vendor{order.function, refused};
  streaming_ = true;
  jam_bytes_ = 0;
  sent_ = 0;
  started_ = now;
  return Vendor{order.function, digital::done};
}

/// Converter output: strain times the active gain, shifted by the active offset. The effect of gain
/// and offset is an estimate; at the calibration's own values both have no effect.
AtiDigitalEmulator::GaugeCounts AtiDigitalEmulator::convert(TimePoint at) {
  FtReading reading = sensor_.read(bench_plant_->contact(at), conversion_at(at), fz_off_n(at));
  hold_if_stuck(reading, at);
  const double factor = calibration_factor(at);
  GaugeCounts out{};
  for (std::size_t g = 0; g < digital::gauges; ++g) {
    double counts = 0;
    for (std::size_t i = 0; i < 6; ++i) counts += gauges_per_count_[g][i] * reading.counts[i];
    const double gain =
        1.0 * registers_.at(digital::holding::active_gain + g) / calibration_.gain[g];
    const double moved =
        registers_.at(digital::holding::active_offset + g) - calibration_.offset[g];
    out[g] = held(gain * factor * counts + moved);
  }
  apply_gauge_faults(out, at);
  return out;
}

void AtiDigitalEmulator::apply_gauge_faults(GaugeCounts& gauges, TimePoint at) {
  using Limits = std::numeric_limits<std::int16_t>;
  if (active_fault(FaultKind::saturation, at) != nullptr)
    for (const std::size_t carries_fz : {0U, 2U, 4U}) gauges[carries_fz] = Limits::max();
  if (firing_fault(FaultKind::absurd_counts, at) != nullptr) gauges.fill(Limits::min());
}

std::uint16_t AtiDigitalEmulator::status_word(TimePoint at) const {
  constexpr int highest_bit = 13;
  std::uint16_t word = registers_.at(digital::holding::status);
  if (const Fault* bit = active_fault(FaultKind::status_bits, at))
    word = static_cast<std::uint16_t>(
        word | 1U << std::clamp(static_cast<int>(bit->amount), 0, highest_bit));
  return word;
}

TimePoint AtiDigitalEmulator::record_time(std::uint64_t record) const {
  // Counted from the start each time: rates that do not divide a second do not drift.
  return started_ + from_seconds(static_cast<double>(record) / params_.rate_hz);
}

std::optional<TimePoint> AtiDigitalEmulator::next_wakeup() const {
  if (!streaming_) return std::nullopt;
  return record_time(sent_);
}

void AtiDigitalEmulator::wake(TimePoint now, ByteSink& out) {
  while (streaming_ && record_time(sent_) <= now) send_record(record_time(sent_), out);
}

void AtiDigitalEmulator::send_record(TimePoint at, ByteSink& out) {
  const bool odd = ++sent_ % 2 == 0;
  if (odd && active_fault(FaultKind::rate_halved, at) != nullptr) return;
  const digital::StreamRecord record{convert(at), status_word(at) != 0};
  if (active_fault(FaultKind::silent, at) != nullptr) return;
  buffer_.clear();
  append(buffer_, record);
  if (firing_fault(FaultKind::crc_errors, at) != nullptr) buffer_.back() ^= 0x55;
  out(buffer_);
}

Calibration mini40_calibration(const std::string& serial, double counts_per_n,
                               double counts_per_nm) {
  Calibration out;
  out.serial = serial;
  out.part_number = "SI-40-2 (simulated)";
  out.family = "DFT";
  out.time = "2026/01/01 00:00:00";
  out.max_rating = rating;
  out.counts_per_force = static_cast<std::int32_t>(counts_per_n);
  out.counts_per_torque = static_cast<std::int32_t>(counts_per_nm);
  out.gain = {543, 555, 569, 579, 565, 567};
  out.offset = {32380, 33120, 34005, 32990, 33467, 34512};
  const Eigen::Matrix<double, 6, 6> pattern = real_pattern();
  const Eigen::Matrix<double, 6, 6> gauges_per_unit = pattern.inverse();
  for (Eigen::Index i = 0; i < 6; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const double rated = double{rating[row]} * (i < 3 ? counts_per_n : counts_per_nm);
    const double scale = gauges_per_unit.col(i).cwiseAbs().maxCoeff() * rated / rated_counts;
    for (Eigen::Index g = 0; g < 6; ++g)
      out.matrix[row][static_cast<std::size_t>(g)] = static_cast<float>(scale * pattern(i, g));
  }
  return out;
}

DigitalRegisters::DigitalRegisters(const Calibration& calibration, int number,
                                   std::uint16_t status_word) {
  const CalibrationRegisters record = encode(calibration);
  std::copy(record.begin(), record.end(), values_.begin() + calibration_address(number));
  // No source gives the active values after power-on: here the calibration's own [E].
  std::copy(calibration.gain.begin(), calibration.gain.end(), values_.begin());
  std::copy(calibration.offset.begin(), calibration.offset.end(),
            values_.begin() + holding::active_offset);
  values_[holding::session_id] = 1;
  values_[holding::status] = status_word;
}

DigitalRegisters::Exceptional DigitalRegisters::read_holding(
    std::uint16_t address, std::uint16_t count, protocols::modbus::Registers& out) const {
  if (std::size_t{address} + count > values_.size()) return ExceptionCode::illegal_address;
  out = protocols::modbus::Registers(std::span(values_).subspan(address, count));
  return std::nullopt;
}

DigitalRegisters::Exceptional DigitalRegisters::write(std::uint16_t address,
                                                      std::span<const std::uint16_t> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!writable(address + i)) return ExceptionCode::illegal_address;
    if (address + i == holding::baud_index && values[i] >= bauds.size())
      return ExceptionCode::illegal_value;
  }
  if (locked_) return ExceptionCode::device_failure;
  std::copy(values.begin(), values.end(), values_.begin() + address);
  return std::nullopt;
}

}  // namespace weft::sim
