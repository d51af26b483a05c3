#include "drivers/ati_digital/digital_driver.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "drivers/api/config.hpp"

namespace weft::drivers {

using namespace protocols::ati_digital;
using namespace protocols::modbus;

namespace {

/// Damage is logged when it begins, then at most once per this period.
constexpr Duration damage_report_period = std::chrono::seconds(1);
/// Set after a power cycle; does not affect the values.
constexpr std::uint16_t watchdog_bit = 1;

std::span<const std::uint16_t> registers_of(const weft::protocols::modbus::Reply& reply) {
  return std::get<ReadReply>(reply).registers.view();  // the exchange checked the kind
}

}  // namespace

DigitalDriver::DigitalDriver(const DigitalSettings& settings, DriverHost& driver_host)
    : DriverBase(driver_host),
      settings_(settings),
      exchange_(driver_host.loop(), {settings.slave, settings.reply_timeout},
                [this](ByteView bytes) { send(bytes); }),
      stale_(driver_host.loop(), [this] { on_stale(); }),
      watch_({settings.rate_hz, settings.stuck_after,
              "Set rate_hz to the records per second of the sensor divided by average"}) {}

Status DigitalDriver::open() noexcept {
  if (Status taken = attach(); !taken) return taken;
  phase_ = Phase::opening;
  registers_.clear();
  bias_ = {};
  // A host that died may have left the sensor streaming.
  exchange_.hush([this](const Status& quiet) { on_hushed(quiet); });
  if (!attached())
    return fail({.code = Errc::io, .what = "first bytes not sent: the link did not accept them"});
  return {};
}

Status DigitalDriver::arm() noexcept {
  if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
  if (phase_ != Phase::idle)
    return fail({.code = Errc::wrong_state, .what = "arm refused: the driver is already arming"});
  phase_ = Phase::starting;
  send_request(Vendor{Function::vendor_stream, start_stream}, &DigitalDriver::on_started);
  if (!attached())
    return fail({.code = Errc::io, .what = "start request not sent: the link did not accept it"});
  return {};
}

Result<std::uint32_t> DigitalDriver::command(const Command& command) noexcept {
  if (Status allowed = require(DriverState::armed, "command"); !allowed)
    return pass(std::move(allowed.error()));
  if (!std::holds_alternative<BiasCommand>(command))
    return fail({.code = Errc::unsupported,
                 .what = "command not supported by a force/torque sensor",
                 .expected = "a bias"});
  bias_ = last_;
  return 0;
}

void DigitalDriver::stop() noexcept {
  if (!attached() || state() == DriverState::closed) return;
  end();
  enter(LifecycleEvent::disarmed);
}

void DigitalDriver::close() noexcept {
  if (attached()) {
    end();
    detach();
  }
  enter(LifecycleEvent::close);
}

void DigitalDriver::make_safe() noexcept {
  end();
}

// Needed by a sensor that streams, harmless to one that does not.
void DigitalDriver::end() {
  phase_ = Phase::idle;
  exchange_.cancel();
  stale_.stop();
  Bytes jam(Exchange::jam_bytes, 0);
  if (std::exchange(unlocked_, false))
    append_rtu(jam, settings_.slave, Request(Vendor{Function::vendor_lock, lock}));
  send_last(jam);
}

void DigitalDriver::received(ByteView bytes, TimePoint arrival) {
  arrival_ = arrival;
  if (phase_ == Phase::streaming)
    on_stream(bytes, arrival);
  else if (phase_ != Phase::idle)
    exchange_.received(bytes);
}

void DigitalDriver::send_request(const Request& request,
                                 void (DigitalDriver::*then)(const Reply&)) {
  exchange_.send_request(request, [this, then](const Result<Reply>& reply) {
    if (!reply) return raise(reply.error());
    (this->*then)(*reply);
  });
}

void DigitalDriver::on_hushed(const Status& status) {
  if (!status) return raise(status.error());
  send_request(Read{Function::read_holding, holding::status, 1}, &DigitalDriver::on_status);
}

void DigitalDriver::on_status(const Reply& reply) {
  status_word_ = registers_of(reply)[0];
  if ((status_word_ & ~watchdog_bit) != 0)
    return raise({.code = Errc::device,
                  .where = "status word",
                  .what = "fault reported by the force/torque sensor",
                  .expected = "0",
                  .got = std::to_string(status_word_) + " (" + status_text(status_word_) + ")",
                  .hint = "Switch the sensor off and on, and check its cable"});
  if (status_word_ != 0)
    host().log(LogLevel::warning, "the force/torque sensor was restarted by its watchdog");
  request_piece();
}

void DigitalDriver::request_piece() {
  std::size_t piece = 0, read = 0;
  while (read < registers_.size()) read += calibration_pieces[piece++];
  const auto address =
      static_cast<std::uint16_t>(calibration_address(settings_.calibration) + read);
  send_request(Read{Function::read_holding, address, calibration_pieces[piece]},
               &DigitalDriver::on_piece);
}

void DigitalDriver::on_piece(const Reply& reply) {
  const auto piece = registers_of(reply);
  registers_.insert(registers_.end(), piece.begin(), piece.end());
  if (registers_.size() < calibration_registers) return request_piece();
  on_calibration();
}

void DigitalDriver::on_calibration() {
  calibration_ = decode_calibration(registers_).value();  // as many registers as requested
  Result<GaugeMatrix> matrix = gauge_matrix(calibration_);
  const std::string place = "calibration " + std::to_string(settings_.calibration);
  if (!settings_.calibration_serial.empty() && settings_.calibration_serial != calibration_.serial)
    return raise({.code = Errc::device_identity,
                  .where = place + ": /calibration_serial",
                  .what = "calibration of the sensor differs from the rig file",
                  .expected = settings_.calibration_serial,
                  .got = calibration_.serial,
                  .hint = "Correct the rig file, or choose another calibration of the sensor"});
  if (!matrix) return raise(Error(matrix.error()).in(place));
  matrix_ = *matrix;
  setup_ = {Vendor{Function::vendor_lock, lock},
            WriteMany{holding::active_offset, Registers(calibration_.offset)},
            WriteMany{holding::active_gain, Registers(calibration_.gain)},
            Vendor{Function::vendor_lock, unlock}};
  unlocked_ = true;
  request_setup();
}

void DigitalDriver::request_setup() {
  if (!setup_.empty()) return send_request(setup_.back(), &DigitalDriver::on_setup);
  unlocked_ = false;
  send_request(Read{Function::read_holding, holding::active_gain, 2 * gauges},
               &DigitalDriver::on_read_back);
}

void DigitalDriver::on_setup(const Reply& reply) {
  if (!accepted(reply)) return;
  setup_.pop_back();
  request_setup();
}

/// Faults the driver and returns false if a vendor function was refused.
bool DigitalDriver::accepted(const Reply& reply) {
  const auto* vendor = std::get_if<Vendor>(&reply);
  if (vendor == nullptr || vendor->data == done) return true;
  raise({.code = Errc::device_refused,
         .where = "function " + std::to_string(static_cast<int>(vendor->function)),
         .what = "command refused by the force/torque sensor",
         .expected = "1",
         .got = std::to_string(vendor->data),
         .hint = "Switch the sensor off and on, then repeat"});
  return false;
}

void DigitalDriver::on_read_back(const Reply& reply) {
  const auto active = registers_of(reply);
  if (!std::equal(calibration_.gain.begin(), calibration_.gain.end(), active.begin()) ||
      !std::equal(calibration_.offset.begin(), calibration_.offset.end(), active.begin() + gauges))
    return raise({.code = Errc::device_refused,
                  .what = "gains and offsets of the calibration not stored in the sensor",
                  .expected = "the written values",
                  .got = "other values",
                  .hint = "Switch the sensor off and on"});
  phase_ = Phase::idle;
  if (exchange_.echoes())
    host().log(LogLevel::info, "the line echoes sent bytes; the echo is skipped");
  host().identified({.reported = {{"serial", calibration_.serial},
                                  {"part_number", calibration_.part_number},
                                  {"family", calibration_.family},
                                  {"calibrated", calibration_.time},
                                  {"calibration", std::to_string(settings_.calibration)}},
                     .scale = {{"counts_per_n", matrix_.counts_per_n},
                               {"counts_per_nm", matrix_.counts_per_nm},
                               {"sign_z", settings_.sign_z}}});
  enter(LifecycleEvent::opened);
}

// The stream begins directly after the answer, perhaps in the same bytes.
void DigitalDriver::on_started(const Reply& reply) {
  if (!accepted(reply)) return;
  phase_ = Phase::streaming;
  stream_.begin_in_step();
  mean_ = {};
  watch_.restart();
  sequence_ = 0;
  damage_reported_ = stream_.resynchronisations();
  stale_.expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
  on_stream(exchange_.rest(), arrival_);
}

void DigitalDriver::on_stream(ByteView bytes, TimePoint arrival) {
  stream_.push(bytes);
  StreamRecord record;
  std::uint32_t lost = 0;
  while (phase_ == Phase::streaming && stream_.next(record, lost)) on_record(record, lost, arrival);
  if (phase_ == Phase::streaming && stream_.resynchronisations() != damage_reported_)
    report_damage(arrival);
}

void DigitalDriver::on_record(const StreamRecord& record, std::uint32_t lost, TimePoint arrival) {
  stale_.expect_within(settings_.stale_after);
  mean_.add(record, lost);
  if (mean_.count() >= settings_.average) on_mean(arrival);
}

void DigitalDriver::on_mean(TimePoint arrival) {
  const std::array<double, 6> gauges = mean_.counts();
  const Sample sample = to_sample(arrival);
  if (auto wrong = watch_.check(gauges, sample.lost, arrival)) return raise(*wrong);
  if (state() == DriverState::open) enter(LifecycleEvent::armed);
  if (state() == DriverState::armed) host().publish(sample);
}

Sample DigitalDriver::to_sample(TimePoint arrival) {
  last_ = matrix_.wrench(mean_.counts());
  WrenchSample wrench;
  for (std::size_t i = 0; i < 3; ++i) {
    wrench.force_n[i] = last_[i] - bias_[i];
    wrench.torque_nm[i] = last_[i + 3] - bias_[i + 3];
  }
  wrench.force_n[2] *= settings_.sign_z;
  wrench.status = status_word_ | (mean_.status_error() ? stream_status_error : 0);
  if (mean_.status_error() && !errors_)
    host().log(LogLevel::warning, "records of the force/torque sensor have the error bit set");
  errors_ = mean_.status_error();
  wrench.valid = !mean_.status_error() && within_rating(last_);
  const std::uint32_t lost = mean_.begin_next(settings_.average);
  sequence_ += lost + 1;
  return {arrival, sequence_, lost, wrench};
}

/// Beyond its rating the calibration is invalid and the sensor may be damaged. `wrench`: the total
/// load, before bias.
bool DigitalDriver::within_rating(const std::array<double, 6>& wrench) {
  bool within = !mean_.saturated();
  for (std::size_t i = 0; i < wrench.size(); ++i)
    within = within && std::abs(wrench[i]) <= matrix_.rating[i];
  if (!within && !overrange_)
    host().log(LogLevel::warning, mean_.saturated()
                                      ? "gauge of the force/torque sensor saturated"
                                      : "load beyond the rating of the force/torque sensor");
  overrange_ = !within;
  return within;
}

void DigitalDriver::report_damage(TimePoint arrival) {
  const bool first = damage_reported_at_ == TimePoint{};
  if (!first && arrival - damage_reported_at_ < damage_report_period) return;
  damage_reported_ = stream_.resynchronisations();
  damage_reported_at_ = arrival;
  host().log(LogLevel::warning, "stream resynchronised " + std::to_string(damage_reported_) +
                                    " times since opening because of damaged bytes");
}

void DigitalDriver::on_stale() {
  if (arrival_ != TimePoint{} && now() - arrival_ < settings_.stale_after)
    return raise({.code = Errc::device_data,
                  .what = "only damaged records from the force/torque sensor",
                  .expected = "a valid record every " +
                              std::to_string(to_seconds(settings_.stale_after)) + " s",
                  .got = "bytes with wrong checksums",
                  .hint = "Check the speed of the line, its cable and sources of interference"});
  raise(
      {.code = Errc::timeout,
       .what = "no record from the force/torque sensor",
       .expected = "one at least every " + std::to_string(to_seconds(settings_.stale_after)) + " s",
       .got = "nothing received",
       .hint = "Check power and cable of the sensor"});
}

constinit const DriverEntry ati_digital_entry{
    .name = "ati_digital",
    .summary = "ATI Digital force/torque sensor, Modbus RTU and its raw stream",
    .config_schema_json = digital_config_schema,
    .create = create_driver<DigitalDriver, read_digital_settings>,
};

const char digital_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "ATI Digital force/torque sensor",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "slave": {"type": "integer", "minimum": 1, "maximum": 247, "default": 10, "description": "Modbus address"},
    "calibration": {"type": "integer", "minimum": 1, "maximum": 16, "default": 1, "description": "number of the calibration in the sensor"},
    "sign_z": {"x-safety": true, "enum": [1, -1], "default": 1, "description": "-1 inverts Fz of the device; a force that pushes the plate down must be positive"},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 1, "maximum": 7000, "default": 100, "description": "samples per second: records per second divided by average"},
    "average": {"type": "integer", "minimum": 1, "maximum": 7000, "default": 1, "description": "records that are averaged to one sample; the sensor sends about 7000 per second at 1.25 Mbaud"},
    "calibration_serial": {"x-safety": true, "type": "string", "maxLength": 8, "description": "serial number of the calibration in the sensor; any other is refused"},
    "stuck_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0, "maximum": 3600, "default": 1, "description": "time after which constant gauges are a fault, because a real sensor has noise; 0: never"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 0.2},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.001, "maximum": 60, "description": "longest time without a record; default: ten samples, at least 0.1"}
  }
})";

Result<DigitalSettings> read_digital_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  DigitalSettings settings;
  settings.slave = static_cast<std::uint8_t>(config.integer("slave", 10, {1, 247}));
  settings.calibration = static_cast<int>(config.integer("calibration", 1, {1, 16}));
  settings.sign_z = config.number("sign_z", 1, {-1, 1});
  if (settings.sign_z != 1 && settings.sign_z != -1)
    config.refuse("sign_z", "sign invalid", "1 or -1", std::to_string(settings.sign_z));
  settings.average = static_cast<std::uint32_t>(config.integer("average", 1, {1, 7000}));
  const double rate_hz = config.number("rate_hz", 100, {1, 7000});
  settings.rate_hz = rate_hz;
  settings.calibration_serial = config.text("calibration_serial", "");
  settings.stuck_after = from_seconds(config.number("stuck_after_s", 1, {0, 3600}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 0.2, {0.01, 60}));
  settings.stale_after =
      from_seconds(config.number("stale_after_s", std::max(0.1, 10 / rate_hz), {0.001, 60}));
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
