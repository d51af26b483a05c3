#include "drivers/taxel_array/frame_watch.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace weft::drivers {

namespace taxel = protocols::taxel;

namespace {

constexpr std::uint32_t least_frames = 20;
/// Every AD7147 has noise of about a count (device-facts.md, CPM finger): a taxel that never
/// changes is dead.
constexpr double noisy_counts = 200;  // mean change from frame to frame that no cloth makes
constexpr double noisy_ratio = 10;    // of the median taxel's
Error fault(std::string message, std::string expected, std::string got, std::string hint) {
  return {.code = Errc::device_data,
          .what = std::move(message),
          .expected = std::move(expected),
          .got = std::move(got),
          .hint = std::move(hint)};
}

}  // namespace

void FrameWatch::begin(const taxel::Frame& frame, TimePoint arrival) {
  from_ = arrival;
  first_us_ = frame.device_us;
  last_ = frame.counts;
  changes_ = {};
  frames_ = 0;
  expected_frames_ = 0;
}

std::optional<Error> FrameWatch::check(const taxel::Frame& frame, std::uint32_t lost,
                                       TimePoint arrival) {
  if (window_ <= Duration::zero()) return std::nullopt;
  if (!from_) {
    rate_.drop();
    clock_.drop();
    begin(frame, arrival);
    return std::nullopt;
  }
  ++frames_;
  expected_frames_ += 1.0 + lost;
  for (std::size_t i = 0; i < frame.taxel_count; ++i) {
    const int change = std::abs(int{frame.counts[i]} - int{last_[i]});
    changes_[i].steps += change != 0 ? 1 : 0;
    changes_[i].path += change;
    changes_[i].largest = std::max(changes_[i].largest, static_cast<double>(change));
  }
  last_ = frame.counts;
  if (frames_ < least_frames || arrival - *from_ < window_) return std::nullopt;
  auto wrong = evaluate(frame, to_seconds(arrival - *from_));
  begin(frame, arrival);
  return wrong;
}

std::optional<Error> FrameWatch::evaluate(const taxel::Frame& frame, double seconds) {
  if (auto wrong = check_still(frame)) return wrong;
  if (auto wrong = check_noise(frame)) return wrong;
  if (auto wrong = check_rate(seconds)) return wrong;
  return check_clock_drift(frame, seconds);
}

std::optional<Error> FrameWatch::check_still(const taxel::Frame& frame) const {
  std::size_t still = 0, which = 0;
  for (std::size_t i = 0; i < frame.taxel_count; ++i) {
    if (changes_[i].steps != 0) continue;
    ++still;
    which = i;
  }
  if (still == 0) return std::nullopt;
  const char* hint = "Look at the sensor's cable; watch_s 0 is for a sensor without noise";
  if (still == frame.taxel_count)
    return fault("the frames are frozen: no taxel changes", "the noise that taxels have",
                 std::to_string(frames_) + " equal frames", hint);
  const std::uint16_t at = frame.counts[which];
  return fault("taxel " + std::to_string(which) +
                   (at == 0xFFFF ? " is saturated" : " is dead: it does not change"),
               "the noise that taxels have", "always " + std::to_string(at) + " counts", hint);
}

std::optional<Error> FrameWatch::check_noise(const taxel::Frame& frame) const {
  std::array<double, taxel::max_taxels> paths{};
  for (std::size_t i = 0; i < frame.taxel_count; ++i)
    paths[i] = (changes_[i].path - changes_[i].largest) / frames_;
  auto sorted = paths;
  const auto middle = sorted.begin() + frame.taxel_count / 2;
  std::nth_element(sorted.begin(), middle, sorted.begin() + frame.taxel_count);
  const double limit = std::max(noisy_counts, noisy_ratio * *middle);
  for (std::size_t i = 0; i < frame.taxel_count; ++i)
    if (paths[i] > limit)
      return fault("taxel " + std::to_string(i) + " is noisy",
                   "changes of about " + std::to_string(*middle) + " counts, as its neighbours",
                   std::to_string(paths[i]) + " counts from frame to frame",
                   "Look at its pad and at the shield");
  return std::nullopt;
}

std::optional<Error> FrameWatch::check_rate(double seconds) {
  const double seen_hz = expected_frames_ / seconds;
  if (!rate_.confirmed(seen_hz, rate_hz_)) return std::nullopt;
  return fault("the array sends at another rate than configured",
               std::to_string(rate_hz_) + " frames/s", std::to_string(seen_hz) + " frames/s",
               "Correct rate_hz in the rig file, or look at the sensor's settings");
}

std::optional<Error> FrameWatch::check_clock_drift(const taxel::Frame& frame, double seconds) {
  if (!has_clock_) return std::nullopt;
  const double device_s = static_cast<std::uint32_t>(frame.device_us - first_us_) * 1e-6;
  return check_clock(clock_, device_s, seconds);
}

}  // namespace weft::drivers
