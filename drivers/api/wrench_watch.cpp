#include "drivers/api/wrench_watch.hpp"

#include <algorithm>
#include <string>

namespace weft::drivers {
namespace {

constexpr std::uint32_t least_same = 20;  // a slow stream may repeat a few values by chance
/// The rate is checked over windows of at least this duration and this number of records.
constexpr double window_s = 2;
constexpr double least_records = 20;

}  // namespace

void WrenchWatch::restart() {
  last_.reset();
  window_from_.reset();
  rate_.drop();
}

std::optional<Error> WrenchWatch::check(const std::array<double, 6>& counts, std::uint32_t lost,
                                        TimePoint arrival) {
  if (auto stuck = check_stuck(counts, arrival)) return stuck;
  return check_rate(lost, arrival);
}

std::optional<Error> WrenchWatch::check_stuck(const std::array<double, 6>& counts,
                                              TimePoint arrival) {
  const bool same = last_ == counts;
  last_ = counts;
  if (!same) {
    changed_at_ = arrival;
    same_ = 0;
    return std::nullopt;
  }
  if (++same_ < least_same || settings_.stuck_after <= Duration::zero() ||
      arrival - changed_at_ < settings_.stuck_after)
    return std::nullopt;
  return Error{
      .code = Errc::device_data,
      .what = "force readings frozen: all six values are constant",
      .expected = "noise",
      .got = "no change for " + std::to_string(to_seconds(arrival - changed_at_)) + " s",
      .hint = "Switch the sensor off and on; set stuck_after_s to 0 for a sensor without noise"};
}

std::optional<Error> WrenchWatch::check_rate(std::uint32_t lost, TimePoint arrival) {
  if (!window_from_) {
    window_from_ = arrival;
    in_window_ = 0;
    return std::nullopt;
  }
  in_window_ += 1.0 + lost;
  const double seconds = to_seconds(arrival - *window_from_);
  if (seconds < std::max(window_s, least_records / settings_.rate_hz)) return std::nullopt;
  const double seen_hz = in_window_ / seconds;
  window_from_ = arrival;
  in_window_ = 0;
  if (!rate_.confirmed(seen_hz, settings_.rate_hz)) return std::nullopt;
  return Error{.code = Errc::device_settings,
               .where = "/rate_hz",
               .what = "rate of the stream differs from the configuration",
               .expected = std::to_string(settings_.rate_hz) + " records/s",
               .got = std::to_string(seen_hz) + " records/s",
               .hint = std::string(settings_.rate_hint)};
}

}  // namespace weft::drivers
