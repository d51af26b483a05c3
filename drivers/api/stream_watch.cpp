#include "drivers/api/stream_watch.hpp"

#include <string>

namespace weft::drivers {

bool Suspicion::confirmed(double seen, double expected) {
  constexpr double tolerance = 0.25;
  constexpr int windows_to_believe = 2;
  const bool right = seen > expected * (1 - tolerance) && seen < expected * (1 + tolerance);
  windows_ = right ? 0 : windows_ + 1;
  return windows_ >= windows_to_believe;
}

PaceWatch::Place PaceWatch::count(std::uint32_t lost, TimePoint arrival) {
  if (settings_.window <= Duration::zero()) return Place::ignored;
  if (!from_) {
    rate_.drop();
    clock_.drop();
    return Place::first;
  }
  ++frames_;
  expected_frames_ += 1.0 + lost;
  const bool over = frames_ >= settings_.least_frames && arrival - *from_ >= settings_.window;
  return over ? Place::last : Place::inside;
}

void PaceWatch::begin_window(std::uint32_t device_us, TimePoint arrival) {
  from_ = arrival;
  first_us_ = device_us;
  frames_ = 0;
  expected_frames_ = 0;
}

std::optional<Error> PaceWatch::check_pace(std::uint32_t device_us, TimePoint arrival) {
  const double seconds = to_seconds(arrival - *from_);
  const double seen_hz = expected_frames_ / seconds;
  if (rate_.confirmed(seen_hz, settings_.rate_hz)) {
    const auto rate = [&](double hz) {
      return std::to_string(hz) + " " + std::string(settings_.rate_unit);
    };
    return Error{.code = settings_.rate_code,
                 .what = std::string(settings_.rate_what),
                 .expected = rate(settings_.rate_hz),
                 .got = rate(seen_hz),
                 .hint = std::string(settings_.rate_hint)};
  }
  const double device_s = static_cast<std::uint32_t>(device_us - first_us_) * 1e-6;
  if (!settings_.has_clock || !clock_.confirmed(device_s, seconds)) return std::nullopt;
  return Error{.code = Errc::device_data,
               .what = "clock of the sensor too fast or too slow",
               .expected = std::to_string(seconds) + " s",
               .got = std::to_string(device_s) + " s by the clock of the sensor",
               .hint = "Check the clock source of the microcontroller"};
}

}  // namespace weft::drivers
