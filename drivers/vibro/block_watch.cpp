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

}  // namespace

BlockWatch::BlockWatch(Duration window, double blocks_hz, int full_scale_counts)
    : StreamWatch({.rate_hz = blocks_hz,
                   .window = window,
                   .least_frames = least_blocks,
                   .rate_what = "the sensor sends at another rate than it says",
                   .rate_unit = "blocks/s",
                   .rate_hint = "Look at the sensor's settings and its line"}),
      full_scale_counts_(full_scale_counts) {}

void BlockWatch::begin(const vibro::Frame& block) {
  std::copy_n(block.values.begin(), first_values_.size(), first_values_.begin());
  changed_ = {};
}

void BlockWatch::note(const vibro::Frame& block) {
  const std::size_t axes = vibro::values_per_reading(block.kind);
  for (std::size_t i = 0; i < block.value_count; ++i)
    if (block.values[i] != first_values_[i % axes]) changed_[i % axes] = true;
}

/// Every such sensor has noise of about a count: an axis that never changes is not measured.
std::optional<Error> BlockWatch::check_values(const vibro::Frame& block) const {
  for (std::size_t axis = 0; axis < vibro::values_per_reading(block.kind); ++axis) {
    if (changed_[axis]) continue;
    const int at = first_values_[axis];
    const bool full = std::abs(at) >= full_scale_counts_;
    return Error{
        .code = Errc::device_data,
        .what = name_of(block.kind, axis) + (full ? " is saturated: it stays at an end of its range"
                                                  : " is frozen: its readings do not change"),
        .expected = "the noise that readings have",
        .got = "always " + std::to_string(at) + " counts",
        .hint = "Look at the sensor and its mounting; watch_s 0 is for a sensor without noise"};
  }
  return std::nullopt;
}

}  // namespace weft::drivers
