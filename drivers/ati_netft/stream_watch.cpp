#include "drivers/ati_netft/stream_watch.hpp"

#include <algorithm>
#include <string>

namespace weft::drivers {
namespace {

constexpr std::uint32_t least_same = 20;  // a slow stream may repeat a few values by chance
/// The rate is looked at over so many seconds and so many records, and believed when two windows
/// in a row are off: a machine that was busy catches up within the next one.
constexpr double window_s = 2;
constexpr double least_records = 20;
constexpr double tolerance = 0.25;
constexpr int windows_to_believe = 2;

}  // namespace

void StreamWatch::restart() {
  last_.reset();
  window_from_.reset();
  wrong_windows_ = 0;
}

std::optional<Error> StreamWatch::look(const protocols::rdt::Record& record, std::uint32_t lost,
                                       TimePoint arrival) {
  if (auto stuck = look_for_stuck(record, arrival)) return stuck;
  return look_at_rate(lost, arrival);
}

std::optional<Error> StreamWatch::look_for_stuck(const protocols::rdt::Record& record,
                                                 TimePoint arrival) {
  const bool same = last_ && last_->force_counts == record.force_counts &&
                    last_->torque_counts == record.torque_counts;
  last_ = record;
  if (!same) {
    changed_at_ = arrival;
    same_ = 0;
    return std::nullopt;
  }
  if (++same_ < least_same || stuck_after_ <= Duration::zero() ||
      arrival - changed_at_ < stuck_after_)
    return std::nullopt;
  return Error{Errc::device,
               "the force is stuck: all six values stay the same",
               {},
               "the noise that a sensor has",
               "no change for " + std::to_string(to_seconds(arrival - changed_at_)) + " s",
               "Switch the box off and on; stuck_after_s 0 is for a sensor without noise"};
}

std::optional<Error> StreamWatch::look_at_rate(std::uint32_t lost, TimePoint arrival) {
  if (!window_from_) {
    window_from_ = arrival;
    in_window_ = 0;
    return std::nullopt;
  }
  in_window_ += 1.0 + lost;
  const double seconds = to_seconds(arrival - *window_from_);
  if (seconds < std::max(window_s, least_records / rate_hz_)) return std::nullopt;
  const double seen_hz = in_window_ / seconds;
  window_from_ = arrival;
  in_window_ = 0;
  const bool right = seen_hz > rate_hz_ * (1 - tolerance) && seen_hz < rate_hz_ * (1 + tolerance);
  wrong_windows_ = right ? 0 : wrong_windows_ + 1;
  if (wrong_windows_ < windows_to_believe) return std::nullopt;
  return Error{Errc::device,
               "the stream has another rate than configured",
               "/rate_hz",
               std::to_string(rate_hz_) + " records/s",
               std::to_string(seen_hz) + " records/s",
               "Set the box's RDT output rate, or correct the rig file"};
}

}  // namespace weft::drivers
