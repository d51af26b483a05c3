// Decides which readings of a stage are accepted. The protocol has no check value, so a damaged
// message may look like a reading. A faulted stage can no longer lift the probe.

#include <cstdlib>
#include <string>

#include "drivers/thorlabs_apt/stage_driver.hpp"

namespace weft::drivers {
namespace {

using namespace protocols::apt;

/// Between two readings a stage moves at most 1.5 times its maximum speed, plus this [mm or
/// degrees]. A reading may be older than its arrival, see longest_wait.
constexpr double jump_margin = 0.1;
constexpr int most_implausible = 3;
/// Number of statuses in a row that must show a problem.
constexpr int least_unwell = 2;

std::string fault_names(std::uint32_t bits) {
  struct Name {
    std::uint32_t bit;
    std::string_view text;
  };
  static constexpr Name names[] = {
      {status::motion_error, "position error too large"},
      {status::instrument_error, "instrument error"},
      {status::over_temperature, "over-temperature"},
      {status::bus_voltage_fault, "bus voltage"},
      {status::commutation_error, "commutation"},
      {status::overload, "overload"},
      {status::encoder_fault, "encoder"},
      {status::over_current, "over-current"},
      {status::supply_current_fault, "supply current"},
      {status::error, "error"},
  };
  std::string out;
  for (const Name& name : names)
    if ((bits & name.bit) != 0) out += (out.empty() ? "" : ", ") + std::string(name.text);
  return out;
}

}  // namespace

bool StageDriver::plausible(const StageReading& reading, TimePoint arrival) {
  if (!settings_.check_jumps || !have_last_ || motion_.kind == MotionKind::home) return true;
  const StageModel& model = *settings_.model;
  const double units = 1.5 * model.max_speed * to_seconds(arrival - last_since_) + jump_margin;
  const auto step = static_cast<double>(
      std::llabs(std::int64_t{reading.position_counts} - last_.position_counts));
  if (step <= units * model.scale.counts_per_unit) {
    implausible_ = 0;
    return true;
  }
  if (++implausible_ == 1) host().log(LogLevel::warning, "implausible position dropped");
  if (implausible_ >= most_implausible)
    raise({.code = Errc::device_data,
           .what = "position jumps",
           .expected = std::to_string(last_.position_counts) + " counts, about",
           .got = std::to_string(reading.position_counts) + " counts",
           .hint = "Check the cable, and whether the counter of the controller was set"});
  return false;
}

/// The problem that this reading shows, if any.
std::optional<Error> StageDriver::ailment(const StageReading& reading) const {
  if ((reading.status_bits & status::any_fault) != 0)
    return Error{.code = Errc::device,
                 .what = "fault reported by the controller: " + fault_names(reading.status_bits),
                 .got = "status " + std::to_string(reading.status_bits)};
  const bool armed = state() == DriverState::armed;
  if (armed && (reading.status_bits & status::channel_enabled) == 0)
    return Error{.code = Errc::device_motion,
                 .what = "channel became disabled",
                 .got = "status " + std::to_string(reading.status_bits),
                 .hint = "Check the front panel of the controller and its power supply"};
  const std::int64_t apart =
      std::llabs(std::int64_t{reading.position_counts} - reading.encoder_counts);
  if (!settings_.encoder || !armed || motion_.kind == MotionKind::home ||
      apart <= settings_.encoder_tolerance_counts)
    return std::nullopt;
  return Error{.code = Errc::device_motion,
               .what = "steps lost: encoder and position differ",
               .expected = std::to_string(reading.position_counts) + " counts",
               .got = std::to_string(reading.encoder_counts) + " counts",
               .hint = "Check for an obstacle, then home the stage again"};
}

/// A problem counts when two statuses in a row show one; the second is requested at once. This also
/// applies to the loss of the homed bit, which prevents motion.
bool StageDriver::believed(const StageReading& reading) {
  const std::optional<Error> wrong = ailment(reading);
  // Homing itself clears the bit.
  const bool lost_home = motion_.kind != MotionKind::home &&
                         (last_.status_bits & ~reading.status_bits & status::homed) != 0;
  if (!wrong && !lost_home) {
    unwell_ = 0;
    return true;
  }
  if (++unwell_ < least_unwell) {
    host().log(LogLevel::warning,
               "status dropped: " + (wrong ? wrong->what : "the stage is no longer homed"));
    put_status_request();
    flush();
    return false;
  }
  unwell_ = 0;
  if (wrong) raise(*wrong);
  return !wrong;
}

}  // namespace weft::drivers
