#include "drivers/vibro/block_watch.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace weft::drivers {

namespace vibro = protocols::vibro;

namespace {

constexpr std::uint32_t least_blocks = 20;
std::string name_of(vibro::Kind kind, std::size_t axis) {
  constexpr std::array names{"the accelerometer's x axis", "the accelerometer's y axis",
                             "the accelerometer's z axis"};
  return kind == vibro::Kind::sound ? "the microphone" : names[axis];
}

Error wrong(std::string message, std::string expected, std::string got, std::string hint) {
  return {.code = Errc::device_data,
          .what = std::move(message),
          .expected = std::move(expected),
          .got = std::move(got),
          .hint = std::move(hint)};
}

}  // namespace

void BlockWatch::begin(const vibro::Frame& block, TimePoint arrival) {
  from_ = arrival;
  first_us_ = block.device_us;
  std::copy_n(block.values.begin(), first_values_.size(), first_values_.begin());
  changed_ = {};
  blocks_ = 0;
  expected_blocks_ = 0;
}

void BlockWatch::note(const vibro::Frame& block) {
  const std::size_t axes = vibro::values_per_reading(block.kind);
  for (std::size_t i = 0; i < block.value_count; ++i)
    if (block.values[i] != first_values_[i % axes]) changed_[i % axes] = true;
}

std::optional<Error> BlockWatch::check(const vibro::Frame& block, std::uint32_t lost,
                                       TimePoint arrival) {
  if (window_ <= Duration::zero()) return std::nullopt;
  if (!from_) {
    rate_.drop();
    clock_.drop();
    begin(block, arrival);
    note(block);
    return std::nullopt;
  }
  ++blocks_;
  expected_blocks_ += 1.0 + lost;
  note(block);
  if (blocks_ < least_blocks || arrival - *from_ < window_) return std::nullopt;
  auto found = evaluate(block, to_seconds(arrival - *from_));
  begin(block, arrival);
  return found;
}

std::optional<Error> BlockWatch::evaluate(const vibro::Frame& block, double seconds) {
  if (auto found = check_still(block)) return found;
  if (auto found = check_rate(seconds)) return found;
  return check_clock_drift(block, seconds);
}

/// Every such sensor has noise of about a count: an axis that never changes is not measured.
std::optional<Error> BlockWatch::check_still(const vibro::Frame& block) const {
  for (std::size_t axis = 0; axis < vibro::values_per_reading(block.kind); ++axis) {
    if (changed_[axis]) continue;
    const int at = first_values_[axis];
    const bool full = std::abs(at) >= full_scale_counts_;
    return wrong(
        name_of(block.kind, axis) + (full ? " is saturated: it stays at an end of its range"
                                          : " is frozen: its readings do not change"),
        "the noise that readings have", "always " + std::to_string(at) + " counts",
        "Look at the sensor and its mounting; watch_s 0 is for a sensor without noise");
  }
  return std::nullopt;
}

std::optional<Error> BlockWatch::check_rate(double seconds) {
  const double seen_hz = expected_blocks_ / seconds;
  if (!rate_.confirmed(seen_hz, blocks_hz_)) return std::nullopt;
  return wrong("the sensor sends at another rate than it says",
               std::to_string(blocks_hz_) + " blocks/s", std::to_string(seen_hz) + " blocks/s",
               "Look at the sensor's settings and its line");
}

std::optional<Error> BlockWatch::check_clock_drift(const vibro::Frame& block, double seconds) {
  const double device_s = static_cast<std::uint32_t>(block.device_us - first_us_) * 1e-6;
  return check_clock(clock_, device_s, seconds);
}

}  // namespace weft::drivers
