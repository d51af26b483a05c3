#include "drivers/taxel_array/taxel_driver.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "protocols/taxel/cpm_finger.hpp"

namespace weft::drivers {

namespace taxel = protocols::taxel;

namespace {
constexpr std::array<std::uint8_t, 1> hello{0};
/// A frame that is older than the last one by less than this came late; by more, it is the first of
/// a sensor that has started anew.
constexpr std::uint32_t latest_us = 2'000'000;
constexpr int late_run_of_a_restart = 3;
}  // namespace

TaxelDriver::TaxelDriver(const TaxelSettings& settings, DriverHost& driver_host)
    : ListeningDriver(driver_host, "a tactile array"),
      settings_(settings),
      watch_(settings.rate_hz, settings.watch, settings.form == TaxelForm::weft),
      silence_(driver_host.loop(), [this] { on_silence(); }) {}

Status TaxelDriver::open() noexcept {
  if (Status allowed = require(DriverState::closed, "open"); !allowed) return allowed;
  if (Status taken = attach(); !taken) return taken;
  splitter_.clear();
  sequence_.reset();
  frame_ = {};
  frame_.taxel_count = settings_.taxels;
  silence_.expect_within(settings_.reply_timeout);
  watch_.restart();
  late_ = 0;
  // A gateway sends unasked; an emulated one learns from this where to.
  if (settings_.form == TaxelForm::cpm_udp && !send(hello))
    return fail({.code = Errc::io, .what = "the link refused the first datagram"});
  return {};
}

void TaxelDriver::await_frames() {
  silence_.expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
}

void TaxelDriver::stop_waiting() noexcept {
  silence_.stop();
}

void TaxelDriver::forget_bytes() noexcept {
  splitter_.clear();
}

void TaxelDriver::received(ByteView bytes, TimePoint arrival) {
  const bool stream = settings_.form == TaxelForm::weft;
  count_damaged(stream ? on_stream(bytes, arrival) : on_datagram(bytes, arrival), arrival);
}

std::uint64_t TaxelDriver::on_stream(ByteView bytes, TimePoint arrival) {
  const std::uint64_t before = splitter_.crc_errors();
  splitter_.push(bytes);
  while (attached() && splitter_.next(frame_)) on_frame(arrival);
  return splitter_.crc_errors() - before;
}

// The gateway sends no number: the driver counts, and cannot see what got lost.
std::uint64_t TaxelDriver::on_datagram(ByteView datagram, TimePoint arrival) {
  const Result<taxel::cpm::Counts> counts = taxel::cpm::decode_datagram(datagram);
  if (!counts) return 1;
  std::copy(counts->begin(), counts->end(), frame_.counts.begin());
  ++frame_.sequence;
  on_frame(arrival);
  return 0;
}

void TaxelDriver::on_frame(TimePoint arrival) {
  if (frame_.taxel_count != settings_.taxels) {
    raise({.code = Errc::device_settings,
           .where = "/taxels",
           .what = "the sensor has another number of taxels",
           .expected = std::to_string(settings_.taxels),
           .got = std::to_string(frame_.taxel_count),
           .hint = "Correct the rig file"});
    return;
  }
  const std::optional<std::uint32_t> lost = count_lost();
  if (!lost || !advance() || state() != DriverState::armed) return;
  if (auto wrong = watch_.check(frame_, *lost, arrival)) return raise(*wrong);
  publish(*lost, arrival);
}

/// Nothing for a frame that came twice or late: it is dropped.
std::optional<std::uint32_t> TaxelDriver::count_lost() {
  const SequenceStep step = sequence_.observe(frame_.sequence);
  const bool older =
      step.event == SequenceEvent::out_of_order || step.event == SequenceEvent::duplicate;
  if (older && settings_.form == TaxelForm::weft && came_late()) {
    if (++late_ == 1) host().log(LogLevel::warning, "a frame came twice or late and was dropped");
    return std::nullopt;
  }
  late_in_a_row_ = 0;
  last_device_us_ = frame_.device_us;
  if (older) {
    watch_.restart();
    host().log(LogLevel::warning, "the sensor's frame numbers jumped back: it has restarted");
    sequence_.reset();
    sequence_.observe(frame_.sequence);
  }
  return step.lost;
}

/// An older frame came late, unless its clock is far behind or a run of such frames shows that the
/// sensor counts anew.
bool TaxelDriver::came_late() {
  const bool next =
      late_in_a_row_ > 0 && frame_.sequence == static_cast<std::uint16_t>(last_late_ + 1);
  late_in_a_row_ = next ? late_in_a_row_ + 1 : 1;
  last_late_ = frame_.sequence;
  return last_device_us_ - frame_.device_us < latest_us && late_in_a_row_ < late_run_of_a_restart;
}

/// Moves along the lifecycle on a good frame. False while nothing is to be published.
bool TaxelDriver::advance() {
  if (state() == DriverState::closed) {
    silence_.stop();
    host().identified({.reported = {{"taxels", std::to_string(frame_.taxel_count)}}, .scale = {}});
    enter(LifecycleEvent::opened);
    return false;
  }
  if (arming()) be_armed();
  if (state() != DriverState::armed) return false;
  silence_.expect_within(settings_.stale_after);
  return true;
}

void TaxelDriver::publish(std::uint32_t lost, TimePoint arrival) {
  host().publish({arrival, frame_.sequence, lost,
                  TaxelSample{frame_.taxels(), frame_.proximity_counts, frame_.ambient_counts,
                              frame_.device_us}});
}

void TaxelDriver::on_silence() {
  raise({.code = Errc::timeout,
         .what = "no frame came from the tactile array",
         .got = "silence",
         .hint = state() == DriverState::closed ? "Check the port, the form and the sensor's power"
                                                : ""});
}

}  // namespace weft::drivers
