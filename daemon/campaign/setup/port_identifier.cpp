#include "daemon/campaign/setup/port_identifier.hpp"

#include <array>
#include <cmath>

#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/printable.hpp"

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;
namespace apt = protocols::apt;

/// Wait after the first reply of a unit: a rack replies for itself and for its cards.
constexpr Duration more_replies = 300ms;
constexpr double us_per_s = 1e6;
/// Frames of an array that suffice to measure its rate.
constexpr std::size_t enough_frames = 200;

/// A port that only receives needs no handshake.
void set_plain(LinkSettings& link) {
  auto* serial = std::get_if<SerialSettings>(&link);
  if (serial != nullptr) serial->rts_cts = serial->ftdi_start_up = false;
}

}  // namespace

std::vector<std::string> stages_of_controller(const std::string& model, std::uint16_t stage_id) {
  std::vector<std::string> out;
  for (const apt::StageModel& stage : apt::stage_models()) {
    if (apt::find_stage(stage.name, model) == nullptr) continue;
    if (stage_id != 0 && stage.stage_id == stage_id) return {std::string(stage.name)};
    out.emplace_back(stage.name);
  }
  return out;
}

double rounded_rate_hz(double measured_hz) {
  if (!std::isfinite(measured_hz) || measured_hz <= 0) return 0;
  constexpr double tolerance = 0.01;
  for (int digits = 1; digits <= 3; ++digits) {
    const double unit = std::pow(10, std::floor(std::log10(measured_hz)) - digits + 1);
    const double rounded = std::round(measured_hz / unit) * unit;
    if (std::abs(rounded - measured_hz) <= tolerance * measured_hz) return rounded;
  }
  return measured_hz;
}

PortIdentifier::PortIdentifier(RealLoop& loop, std::string place, std::vector<PortAttempt> attempts)
    : loop_(&loop),
      attempts_(std::move(attempts)),
      imprint_(std::make_unique<protocols::imprint::Splitter>()),
      timer_(loop, [this] { on_time(); }) {
  found_.place = std::move(place);
}

void PortIdentifier::start() {
  begin_attempt();
}

void PortIdentifier::begin_attempt() {
  if (next_ == attempts_.size()) return finish();
  const PortAttempt& attempt = attempts_[next_];
  found_.link = attempt.link;
  auto link = open_link(*loop_, attempt.link);
  if (!link) {
    found_.problem = link.error();
    return finish();
  }
  link_ = std::move(*link);
  frames_ = 0;
  link_->on_receive([this](ByteView bytes, TimePoint arrival) { received(bytes, arrival); });
  is_listening_ = false;
  const auto* serial = std::get_if<SerialSettings>(&attempt.link);
  timer_.start(serial != nullptr && serial->ftdi_start_up ? ftdi_start_up_time : Duration{});
}

// Starts the timer only now: in a late loop it could expire while the request is being sent.
void PortIdentifier::begin_listening() {
  is_listening_ = true;
  if (attempts_[next_].asks_stage) request_info();
  timer_.start(listen_time);
}

void PortIdentifier::request_info() {
  Bytes out;
  for (const std::uint8_t unit : {apt::address::usb_unit, apt::address::bay_first})
    apt::append_short(out, apt::MessageId::hw_req_info, 0, 0, {unit, apt::address::host});
  static_cast<void>(link_->write(out));
}

// The link may be in the middle of its own callback, so it is destroyed in the next turn of the
// loop.
void PortIdentifier::finish() {
  done_ = true;
  timer_.cancel();
  if (link_) link_->on_receive({});
}

void PortIdentifier::end_attempt() {
  digital_.reset();
  link_.reset();
  ++next_;
  begin_attempt();
}

void PortIdentifier::on_time() {
  if (!is_listening_ && found_.kind == DeviceKind::unknown) return begin_listening();
  if (found_.kind != DeviceKind::unknown) {
    if (frames_ > 1)
      found_.rate_hz = rounded_rate_hz(static_cast<double>(frames_ - 1) * us_per_s /
                                       static_cast<double>(last_us_ - first_us_));
    return finish();
  }
  if (attempts_[next_].asks_digital && !digital_) return request_digital();
  end_attempt();
}

void PortIdentifier::request_digital() {
  digital_ = std::make_unique<DigitalIdentifier>(
      *loop_, [this](ByteView bytes) { static_cast<void>(link_->write(bytes)); },
      [this](const Result<DigitalSensor>& sensor) {
        if (!sensor) return timer_.start({});  // not from inside its own callback
        found_.kind = DeviceKind::digital_ft;
        found_.model = printable(sensor->part_number, max_text);
        found_.serial = printable(sensor->calibration_serial, max_text);
        found_.rate_hz = rounded_rate_hz(sensor->records_per_s);
        finish();
      });
  digital_->start();
}

void PortIdentifier::received(ByteView bytes, TimePoint) {
  if (digital_) return digital_->received(bytes);
  if (attempts_[next_].asks_stage) receive_stage(bytes);
  if (!done_) receive_streams(bytes);
}

void PortIdentifier::receive_stage(ByteView bytes) {
  apt_.push(bytes);
  apt::Message message;
  while (apt_.next(message))
    if (message.id == apt::MessageId::hw_get_info) on_info(message);
}

// The unit's own reply takes precedence over that of a card in it.
void PortIdentifier::on_info(const apt::Message& message) {
  const auto info = apt::decode_body<apt::HardwareInfo>(message.data);
  const bool from_unit = message.source == apt::address::usb_unit;
  if (!info || (found_.kind == DeviceKind::stage && !from_unit)) return;
  found_.kind = DeviceKind::stage;
  found_.model = info->model.str();
  found_.serial = std::to_string(info->serial);
  found_.stage_id = info->stage_id;
  found_.destination = message.source;
  found_.stages = stages_of_controller(found_.model, info->stage_id);
  found_.notes.clear();
  if (!from_unit)
    found_.notes.emplace_back("rack: only its first card is used, because a port has one stage");
  timer_.start(more_replies);
}

void PortIdentifier::receive_streams(ByteView bytes) {
  taxels_.push(bytes);
  for (protocols::taxel::Frame frame; !done_ && taxels_.next(frame);) on_taxels(frame);
  vibro_.push(bytes);
  for (protocols::vibro::Frame frame; !done_ && vibro_.next(frame);) {
    if (frame.kind != protocols::vibro::Kind::description) continue;
    constexpr double mhz_per_hz = 1e3;
    found_.kind = DeviceKind::vibration_sensor;
    found_.serial = std::to_string(frame.description.serial);
    found_.rate_hz = frame.description.acceleration.rate_mhz / mhz_per_hz;
    found_.sound_rate_hz = frame.description.sound.rate_mhz / mhz_per_hz;
    set_plain(found_.link);
    return finish();
  }
  imprint_->push(bytes);
  const auto frame = std::make_unique<protocols::imprint::Frame>();
  while (!done_ && imprint_->next(*frame)) {
    if (frame->kind != protocols::imprint::Kind::description) continue;
    found_.kind = DeviceKind::imprint_array;
    found_.serial = std::to_string(frame->description.serial);
    found_.rows = frame->description.rows;
    found_.cols = frame->description.cols;
    if (frame->description.period_us > 0)
      found_.rate_hz = rounded_rate_hz(us_per_s / frame->description.period_us);
    set_plain(found_.link);
    return finish();
  }
}

void PortIdentifier::on_taxels(const protocols::taxel::Frame& frame) {
  if (frames_++ == 0) {
    found_.kind = DeviceKind::taxel_array;
    found_.taxels = frame.taxel_count;
    first_us_ = frame.device_us;
    set_plain(found_.link);
    timer_.start(listen_time);
  }
  last_us_ = frame.device_us;
  if (frames_ == enough_frames) timer_.start({});
}

}  // namespace weft::daemon
