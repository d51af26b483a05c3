#include "drivers/taxel_array/taxel_driver.hpp"

#include <algorithm>
#include <string>

#include "protocols/taxel/cpm_finger.hpp"

namespace weft::drivers {

namespace taxel = protocols::taxel;

namespace {
/// Damage is logged when it begins, and then so often at most.
constexpr Duration damage_report_period = std::chrono::seconds(1);
}  // namespace

TaxelDriver::TaxelDriver(const TaxelSettings& settings, DriverHost& driver_host)
    : DriverBase(driver_host),
      settings_(settings),
      silence_(driver_host.loop(), [this] { on_silence(); }) {}

Status TaxelDriver::open() noexcept {
  if (Status allowed = require(DriverState::closed, "open"); !allowed) return allowed;
  if (Status taken = attach(); !taken) return taken;
  splitter_.clear();
  sequence_.reset();
  frame_ = {};
  frame_.taxel_count = settings_.taxels;
  silence_.expect_within(settings_.reply_timeout);
  return {};
}

Status TaxelDriver::arm() noexcept {
  if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
  if (arming_) return fail(Errc::wrong_state, "arm is refused: arming is under way");
  arming_ = true;
  silence_.expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
  return {};
}

Result<std::uint32_t> TaxelDriver::command(const Command&) noexcept {
  if (Status allowed = require(DriverState::armed, "the command"); !allowed)
    return pass(std::move(allowed.error()));
  return fail(Errc::unsupported, "a tactile array takes no commands");
}

void TaxelDriver::stop() noexcept {
  rest();
  enter(LifecycleEvent::disarmed);
}

void TaxelDriver::close() noexcept {
  rest();
  splitter_.clear();
  detach();
  enter(LifecycleEvent::close);
}

void TaxelDriver::make_safe() noexcept {
  rest();
}

void TaxelDriver::rest() {
  arming_ = false;
  silence_.stop();
}

void TaxelDriver::received(ByteView bytes, TimePoint arrival) {
  if (settings_.form == TaxelForm::weft)
    take_stream(bytes, arrival);
  else
    take_datagram(bytes, arrival);
  if (damaged_ != damaged_reported_ && attached()) report_damage(arrival);
}

void TaxelDriver::take_stream(ByteView bytes, TimePoint arrival) {
  const std::uint64_t before = splitter_.crc_errors();
  splitter_.push(bytes);
  while (attached() && splitter_.next(frame_)) on_frame(arrival);
  damaged_ += splitter_.crc_errors() - before;
}

// The gateway sends no number: the driver counts, and cannot see what got lost.
void TaxelDriver::take_datagram(ByteView datagram, TimePoint arrival) {
  const Result<taxel::cpm::Counts> counts = taxel::cpm::decode_datagram(datagram);
  if (!counts) {
    ++damaged_;
    return;
  }
  std::copy(counts->begin(), counts->end(), frame_.counts.begin());
  ++frame_.sequence;
  on_frame(arrival);
}

void TaxelDriver::on_frame(TimePoint arrival) {
  if (frame_.taxel_count != settings_.taxels) {
    raise({Errc::device, "the sensor has another number of taxels", "/taxels",
           std::to_string(settings_.taxels), std::to_string(frame_.taxel_count),
           "Correct the rig file"});
    return;
  }
  const std::uint32_t lost = count_lost();
  if (advance() && state() == DriverState::armed) publish(lost, arrival);
}

std::uint32_t TaxelDriver::count_lost() {
  const SequenceStep step = sequence_.observe(frame_.sequence);
  // A stream cannot deliver out of order: the sensor has started anew.
  if (step.event == SequenceEvent::out_of_order || step.event == SequenceEvent::duplicate) {
    host().log(LogLevel::warning, "the sensor's frame numbers jumped back: it has restarted");
    sequence_.reset();
    sequence_.observe(frame_.sequence);
  }
  return step.lost;
}

/// Moves along the lifecycle on a good frame. False while nothing is to be published.
bool TaxelDriver::advance() {
  if (state() == DriverState::closed) {
    silence_.stop();
    host().identified({.reported = {{"taxels", std::to_string(frame_.taxel_count)}}, .scale = {}});
    enter(LifecycleEvent::opened);
    return false;
  }
  if (arming_) {
    arming_ = false;
    enter(LifecycleEvent::armed);
  }
  if (state() != DriverState::armed) return false;
  silence_.expect_within(settings_.stale_after);
  return true;
}

void TaxelDriver::publish(std::uint32_t lost, TimePoint arrival) {
  host().publish({arrival, frame_.sequence, lost,
                  TaxelSample{frame_.taxels(), frame_.proximity_counts, frame_.ambient_counts,
                              frame_.device_us}});
}

void TaxelDriver::report_damage(TimePoint arrival) {
  const bool first = damaged_reported_ == 0;
  if (!first && arrival - damage_reported_at_ < damage_report_period) return;
  damaged_reported_ = damaged_;
  damage_reported_at_ = arrival;
  host().log(LogLevel::warning, "damaged frames so far: " + std::to_string(damaged_));
}

void TaxelDriver::on_silence() {
  raise({Errc::timeout,
         "no frame came from the tactile array",
         {},
         {},
         "silence",
         state() == DriverState::closed ? "Check the port, the form and the sensor's power" : ""});
}

}  // namespace weft::drivers
