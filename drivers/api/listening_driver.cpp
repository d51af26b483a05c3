#include "drivers/api/listening_driver.hpp"

#include <string>

namespace weft {

namespace {

constexpr Duration damage_report_period = std::chrono::seconds(1);

}  // namespace

Status ListeningDriver::arm() noexcept {
  if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
  if (arming_)
    return fail({.code = Errc::wrong_state, .what = "arm refused: the driver is already arming"});
  arming_ = true;
  await_frames();
  return {};
}

Result<std::uint32_t> ListeningDriver::command(const Command&) noexcept {
  if (Status allowed = require(DriverState::armed, "command"); !allowed)
    return pass(std::move(allowed.error()));
  return fail(
      {.code = Errc::unsupported, .what = "command not supported by " + std::string(device_)});
}

void ListeningDriver::stop() noexcept {
  rest();
  enter(LifecycleEvent::disarmed);
}

void ListeningDriver::close() noexcept {
  rest();
  detach();
  enter(LifecycleEvent::close);
}

void ListeningDriver::be_armed() {
  arming_ = false;
  enter(LifecycleEvent::armed);
}

bool ListeningDriver::advance(Duration stale_after) {
  if (arming_) be_armed();
  if (state() != DriverState::armed) return false;
  silence_.expect_within(stale_after);
  return true;
}

void ListeningDriver::rest() noexcept {
  arming_ = false;
  silence_.stop();
  stop_waiting();
}

void ListeningDriver::count_damaged(std::uint64_t frames, TimePoint arrival) {
  damaged_ += frames;
  if (damaged_ == damaged_reported_ || !attached()) return;
  const bool first = damaged_reported_ == 0;
  if (!first && arrival - damage_reported_at_ < damage_report_period) return;
  damaged_reported_ = damaged_;
  damage_reported_at_ = arrival;
  host().log(LogLevel::warning, "damaged frames since opening: " + std::to_string(damaged_));
}

}  // namespace weft
