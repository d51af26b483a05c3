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

FrameWatch::FrameWatch(double rate_hz, Duration window, bool has_clock)
    : StreamWatch(
          {.rate_hz = rate_hz,
           .window = window,
           .least_frames = least_frames,
           .has_clock = has_clock,
           .rate_what = "the array sends at another rate than configured",
           .rate_unit = "frames/s",
           .rate_hint = "Correct rate_hz in the rig file, or look at the sensor's settings"}) {}

void FrameWatch::begin(const Frame& frame) {
  last_ = frame.counts;
  changes_ = {};
}

void FrameWatch::note(const Frame& frame) {
  for (std::size_t i = 0; i < frame.taxel_count; ++i) {
    const int change = std::abs(int{frame.counts[i]} - int{last_[i]});
    changes_[i].steps += change != 0 ? 1 : 0;
    changes_[i].path += change;
    changes_[i].largest = std::max(changes_[i].largest, static_cast<double>(change));
  }
  last_ = frame.counts;
}

std::optional<Error> FrameWatch::check_values(const Frame& frame) const {
  auto wrong = check_still(frame);
  return wrong ? wrong : check_noise(frame);
}

std::optional<Error> FrameWatch::check_still(const Frame& frame) const {
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
                 std::to_string(frames()) + " equal frames", hint);
  const std::uint16_t at = frame.counts[which];
  return fault("taxel " + std::to_string(which) +
                   (at == 0xFFFF ? " is saturated" : " is dead: it does not change"),
               "the noise that taxels have", "always " + std::to_string(at) + " counts", hint);
}

std::optional<Error> FrameWatch::check_noise(const Frame& frame) const {
  std::array<double, taxel::max_taxels> paths{};
  for (std::size_t i = 0; i < frame.taxel_count; ++i)
    paths[i] = (changes_[i].path - changes_[i].largest) / frames();
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

}  // namespace weft::drivers
