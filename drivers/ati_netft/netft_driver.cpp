#include "drivers/ati_netft/netft_driver.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "drivers/api/config.hpp"
#include "protocols/base/printable.hpp"

namespace weft::drivers {

using namespace protocols::rdt;

namespace {
/// Datagrams may be lost: maximum tries of the one-sample request of open().
constexpr int max_opening_tries = 3;
constexpr std::uint32_t late_run_of_a_restart = 5;

std::array<double, 6> counts_of(const Record& record) {
  std::array<double, 6> counts{};
  std::copy_n(record.force_counts.begin(), 3, counts.begin());
  std::copy_n(record.torque_counts.begin(), 3, counts.begin() + 3);
  return counts;
}
}  // namespace

NetftDriver::NetftDriver(const NetftSettings& settings, DriverHost& driver_host)
    : DriverBase(driver_host),
      settings_(settings),
      watch_({settings.rate_hz, settings.stuck_after,
              "Set the RDT output rate of the box, or correct the rig file"}),
      reader_([this](const Result<BoxPages>& pages) { on_pages(pages); }),
      opening_(driver_host.loop(), [this] { on_opening_timeout(); }),
      stale_(driver_host.loop(), [this] { on_stale(); }) {}

Status NetftDriver::open() noexcept {
  if (Status taken = attach(); !taken) return taken;
  bad_datagrams_ = late_records_ = 0;
  pages_.reset();
  opening_tries_ = 1;
  Link* http = host().http();
  if (http == nullptr) return request_next();
  opening_.start(settings_.reply_timeout * max_opening_tries);
  if (Status sent = reader_.read(*http); !sent) {
    raise(sent.error());
    return sent;
  }
  return {};
}

Status NetftDriver::request_next() {
  opening_.start(settings_.reply_timeout);
  if (!request(RequestCommand::start_realtime, 1))
    return fail({.code = Errc::io, .what = "opening request not sent: the link did not accept it"});
  return {};
}

void NetftDriver::on_pages(const Result<BoxPages>& pages) {
  if (!attached()) return;
  if (!pages) return raise(pages.error());
  if (Status same = agree(*pages); !same) return raise(same.error());
  pages_ = *pages;
  static_cast<void>(request_next());
}

/// Takes missing settings from the pages of the box. Errors: values that differ from the
/// configuration.
Status NetftDriver::agree(const BoxPages& pages) {
  const char* hint = "Correct the rig file, or choose the calibration on the pages of the box";
  const SettingsPage& page = pages.settings;
  const auto force = newtons_per(page.force_unit);
  if (!force) return pass(force.error(), "scfgfu");
  const auto torque = newton_metres_per(page.torque_unit);
  if (!torque) return pass(torque.error(), "scfgtu");
  if (!page.rdt_enabled)
    return fail({.code = Errc::device_settings,
                 .what = "RDT interface of the box switched off",
                 .hint = "Enable RDT on the web page Communications of the box"});
  const auto differ = [&](const char* key, double configured, double device_value) {
    return fail({.code = Errc::device_settings,
                 .where = key,
                 .what = "scale of the box differs from the rig file",
                 .expected = std::to_string(configured),
                 .got = std::to_string(device_value),
                 .hint = hint});
  };
  const double n = *force / page.counts_per_force, nm = *torque / page.counts_per_torque;
  const auto same = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(a); };
  if (settings_.force_scale_given && !same(settings_.newton_per_count, n))
    return differ("/counts_per_newton", 1 / settings_.newton_per_count, 1 / n);
  if (settings_.torque_scale_given && !same(settings_.newton_metre_per_count, nm))
    return differ("/counts_per_newton_metre", 1 / settings_.newton_metre_per_count, 1 / nm);
  if (page.rdt_rate_hz > 0 && std::abs(page.rdt_rate_hz - settings_.rate_hz) > 0.5)
    return fail({.code = Errc::device_settings,
                 .where = "/rate_hz",
                 .what = "rate of the box differs from the rig file",
                 .expected = std::to_string(settings_.rate_hz) + " Hz",
                 .got = std::to_string(page.rdt_rate_hz) + " Hz",
                 .hint = hint});
  if (Status serial = agree_on_serial(pages); !serial) return serial;
  settings_.newton_per_count = n;
  settings_.newton_metre_per_count = nm;
  return {};
}

/// Checks the serial number: from the calibration page, or from the settings page if the box has no
/// calibration page.
Status NetftDriver::agree_on_serial(const BoxPages& pages) {
  const std::string& wanted = settings_.calibration_serial;
  const std::string found = pages.calibration_serial();
  if (found.empty() && (pages.missing || !wanted.empty())) {
    const std::string why =
        pages.missing ? to_string(*pages.missing) : "no serial number on the page";
    if (!wanted.empty())
      return fail({.code = Errc::device_identity,
                   .where = "/calibration_serial",
                   .what = "no calibration serial number on the pages of the box",
                   .expected = wanted,
                   .got = why,
                   .hint = "Remove calibration_serial for a box without a calibration page"});
    host().log(LogLevel::info, "calibration page of the box not readable: " + why);
  }
  if (wanted.empty() || wanted == found) return {};
  return fail({.code = Errc::device_identity,
               .where = "/calibration_serial",
               .what = "calibration of the box differs from the rig file",
               .expected = wanted,
               .got = printable(found, 64),
               .hint = "Correct the rig file, or choose the calibration on the pages of the box"});
}

/// RDT records carry no serial number and no calibration: only the pages identify the box.
DeviceIdentity NetftDriver::identity() const {
  DeviceIdentity identity;
  identity.scale = {{"counts_per_n", 1 / settings_.newton_per_count},
                    {"counts_per_nm", 1 / settings_.newton_metre_per_count},
                    {"sign_z", settings_.sign_z}};
  if (!pages_) return identity;
  const auto report = [&](const char* key, const std::string& text) {
    if (!text.empty()) identity.reported.emplace_back(key, printable(text, 64));
  };
  report("product", pages_->settings.product);
  report("calibration_serial", pages_->calibration_serial());
  report("rdt_rate_hz", std::to_string(pages_->settings.rdt_rate_hz));
  return identity;
}

Status NetftDriver::arm() noexcept {
  if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
  if (streaming_)
    return fail({.code = Errc::wrong_state, .what = "arm refused: the driver is already arming"});
  sequence_.reset();
  watch_.restart();
  late_in_a_row_ = 0;
  streaming_ = true;
  stale_.expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
  if (!request(RequestCommand::start_realtime, 0))
    return fail({.code = Errc::io, .what = "start request not sent: the link did not accept it"});
  return {};
}

Result<std::uint32_t> NetftDriver::command(const Command& command) noexcept {
  if (Status allowed = require(DriverState::armed, "command"); !allowed)
    return pass(std::move(allowed.error()));
  if (!std::holds_alternative<BiasCommand>(command))
    return fail({.code = Errc::unsupported,
                 .what = "command not supported by a force/torque sensor",
                 .expected = "a bias"});
  if (!request(RequestCommand::set_bias, 0))
    return fail({.code = Errc::io, .what = "bias request not sent: the link did not accept it"});
  return 0;
}

void NetftDriver::stop() noexcept {
  if (!attached()) return;
  end_stream();
  enter(LifecycleEvent::disarmed);
}

void NetftDriver::close() noexcept {
  if (attached()) {
    end_stream();
    detach();
  }
  enter(LifecycleEvent::close);
}

void NetftDriver::make_safe() noexcept {
  end_stream();
}

// Needed by a box that a dead host left sending, harmless to one that sends nothing.
void NetftDriver::end_stream() {
  streaming_ = false;
  reader_.let_go();
  opening_.cancel();
  stale_.stop();
  send_last(encode(Request{RequestCommand::stop, 0}));
}

bool NetftDriver::request(RequestCommand command, std::uint32_t sample_count) {
  return send(encode(Request{command, sample_count}));
}

void NetftDriver::received(ByteView datagram, TimePoint arrival) {
  const Result<std::size_t> count = record_count(datagram);
  if (!count) return on_bad_datagram(count.error());
  for (std::size_t i = 0; attached() && i < *count; ++i) {
    const Result<Record> record = decode_record(datagram.subspan(i * record_size, record_size));
    if (record) on_record(*record, arrival);
  }
}

void NetftDriver::on_bad_datagram(const Error& error) {
  if (++bad_datagrams_ == 1) host().log(LogLevel::warning, to_string(error));
}

void NetftDriver::on_record(const Record& record, TimePoint arrival) {
  if (state() == DriverState::closed) {
    if (reader_.reading())
      return;  // from a stream that a dead host left; the pages must be read first
    opening_.cancel();
    host().identified(identity());
    enter(LifecycleEvent::opened);
    return;
  }
  if (!streaming_) return;
  const SequenceStep step = sequence_.observe(record.rdt_sequence);
  if (step.event == SequenceEvent::duplicate || step.event == SequenceEvent::out_of_order)
    return on_late_record(record);
  late_in_a_row_ = 0;
  stale_.expect_within(settings_.stale_after);
  if (auto wrong = watch_.check(counts_of(record), step.lost, arrival)) return raise(*wrong);
  if (state() == DriverState::open) enter(LifecycleEvent::armed);
  if (state() == DriverState::armed) host().publish(to_sample(record, step.lost, arrival));
}

/// A few records arrive late over UDP. A run of consecutive late numbers shows that the box has
/// restarted its count: it was off and has lost its bias.
void NetftDriver::on_late_record(const Record& record) {
  if (++late_records_ == 1)
    host().log(LogLevel::warning, "record received twice or out of order; it was dropped");
  const bool next = late_in_a_row_ > 0 && record.rdt_sequence == last_late_ + 1;
  late_in_a_row_ = next ? late_in_a_row_ + 1 : 1;
  last_late_ = record.rdt_sequence;
  if (late_in_a_row_ < late_run_of_a_restart) return;
  raise({.code = Errc::device_restarted,
         .what = "Net F/T box restarted: its record numbers start again",
         .got = "record " + std::to_string(record.rdt_sequence),
         .hint = "Check the power of the box and other clients; set the bias again"});
}

Sample NetftDriver::to_sample(const Record& record, std::uint32_t lost, TimePoint arrival) {
  WrenchSample wrench;
  for (std::size_t i = 0; i < 3; ++i) {
    wrench.force_n[i] = record.force_counts[i] * settings_.newton_per_count;
    wrench.torque_nm[i] = record.torque_counts[i] * settings_.newton_metre_per_count;
  }
  wrench.force_n[2] *= settings_.sign_z;
  wrench.status = record.status;
  wrench.valid = values_valid(record.status) && within_rating(wrench);
  return {arrival, record.rdt_sequence, lost, wrench};
}

/// Beyond its rating the calibration is invalid and the sensor may be damaged.
bool NetftDriver::within_rating(const WrenchSample& wrench) {
  bool within = true;
  for (std::size_t i = 0; i < 3; ++i)
    within = within && std::abs(wrench.force_n[i]) <= settings_.rated_force_n[i];
  if (!within && !overrange_)
    host().log(LogLevel::warning, "force beyond the rating of the force/torque sensor");
  overrange_ = !within;
  return within;
}

void NetftDriver::on_opening_timeout() {
  if (reader_.reading()) {
    if (reader_.go_without_calibration()) return;
    raise({.code = Errc::timeout,
           .where = "/http",
           .what = "no settings page from the Net F/T box",
           .got = "nothing received",
           .hint = "Check the address of the HTTP port of the box in the rig file"});
    return;
  }
  if (opening_tries_ < max_opening_tries) {
    ++opening_tries_;
    if (request(RequestCommand::start_realtime, 1)) opening_.start(settings_.reply_timeout);
    return;
  }
  raise(
      {.code = Errc::timeout,
       .what = "no reply from the Net F/T box",
       .expected = "a record within " + std::to_string(to_seconds(settings_.reply_timeout)) + " s",
       .got = "nothing after " + std::to_string(max_opening_tries) + " requests",
       .hint = "Check the address in the rig file, the cable and the RDT setting of the box"});
}

void NetftDriver::on_stale() {
  raise(
      {.code = Errc::timeout,
       .what = "no record from the force/torque sensor",
       .expected = "one at least every " + std::to_string(to_seconds(settings_.stale_after)) + " s",
       .got = "nothing received",
       .hint =
           "Check the cable, and stop other clients: their start request redirects the stream"});
}

constinit const DriverEntry ati_netft_entry{
    .name = "ati_netft",
    .summary = "ATI force/torque sensor behind a Net F/T box, RDT over UDP",
    .config_schema_json = netft_config_schema,
    .create = create_driver<NetftDriver, read_netft_settings>,
};

namespace {
constexpr double not_given = 0;
constexpr double usual_counts = 1e6;  // cfgcpf and cfgcpt of nearly every box
}  // namespace

const char netft_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "ATI force/torque sensor behind a Net F/T box",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "counts_per_newton": {"x-unit": "1/N", "type": "number", "minimum": 1, "maximum": 1e9, "default": 1000000, "description": "counts per newton, cfgcpf of the box"},
    "counts_per_newton_metre": {"x-unit": "1/N/m", "type": "number", "minimum": 1, "maximum": 1e9, "default": 1000000, "description": "counts per newton metre, cfgcpt of the box"},
    "sign_z": {"x-safety": true, "enum": [1, -1], "default": 1, "description": "-1 inverts Fz of the device; a force that pushes the plate down must be positive"},
    "rated_force_n": {"x-unit": "N", "x-safety": true, "type": "array", "items": {"type": "number", "minimum": 0.1, "maximum": 10000}, "minItems": 3, "maxItems": 3, "default": [40, 40, 120], "description": "a sample beyond these is marked invalid"},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 1, "maximum": 7000, "default": 100, "description": "RDT output rate set in the box"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 0.5},
    "calibration_serial": {"x-safety": true, "type": "string", "maxLength": 64, "x-link": "http", "description": "serial number on the calibration page of the box, or cfgcalsn of its settings page; any other is refused; needs the http link of the device"},
    "stuck_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0, "maximum": 3600, "default": 1, "description": "time after which six constant values are a fault, because a real sensor has noise; 0: never"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.001, "maximum": 60, "description": "longest time without a record; default: ten periods of the stream, at least 0.1"}
  }
})";

Result<NetftSettings> read_netft_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  NetftSettings settings;
  const double per_n = config.number("counts_per_newton", not_given, {1, 1e9});
  const double per_nm = config.number("counts_per_newton_metre", not_given, {1, 1e9});
  settings.force_scale_given = per_n != not_given;
  settings.torque_scale_given = per_nm != not_given;
  settings.newton_per_count = 1 / (settings.force_scale_given ? per_n : usual_counts);
  settings.newton_metre_per_count = 1 / (settings.torque_scale_given ? per_nm : usual_counts);
  settings.calibration_serial = config.text("calibration_serial", "");
  settings.sign_z = config.number("sign_z", 1, {-1, 1});
  if (settings.sign_z != 1 && settings.sign_z != -1)
    config.refuse("sign_z", "sign invalid", "1 or -1", std::to_string(settings.sign_z));
  const std::vector<double> rated = config.numbers("rated_force_n", {40, 40, 120}, {0.1, 1e4});
  std::copy(rated.begin(), rated.end(), settings.rated_force_n.begin());
  const double rate_hz = config.number("rate_hz", 100, {1, 7000});
  settings.rate_hz = rate_hz;
  settings.stuck_after = from_seconds(config.number("stuck_after_s", 1, {0, 3600}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 0.5, {0.01, 60}));
  settings.stale_after =
      from_seconds(config.number("stale_after_s", std::max(0.1, 10 / rate_hz), {0.001, 60}));
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
