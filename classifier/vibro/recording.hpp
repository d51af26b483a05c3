#pragma once
// A recording of several channels of different rates, and the windows that are cut from it.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "classifier/vibro/feature_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

struct Recording {
  std::string file;   ///< unique in its data set
  std::string label;  ///< texture
  std::string group;  ///< what must not be split between training and test
  std::vector<Channel> channels;
  std::vector<std::vector<double>> samples;  ///< per channel, from the same instant on

  /// Of the shortest channel.
  [[nodiscard]] double duration_s() const;
};

/// Samples of one window, a span per channel.
using WindowView = std::vector<std::span<const double>>;

/// First sample of a window that begins at `start_s`, and how many `window_s` has: each to the
/// nearest, so that windows of one length have the same number wherever they begin.
std::size_t first_sample(double start_s, double rate_hz);
std::size_t samples_in(double window_s, double rate_hz);

/// Refuses a window that no channel, or not every channel, holds to its end, or of which one has no
/// sample.
Result<WindowView> window_at(const Recording& recording, double start_s, double window_s);

/// Where a window lies.
struct Place {
  double start_s = 0.0;
  std::size_t block = 0;  ///< which contiguous part of the recording it lies in
};

/// A clock that the clocks of all channels meet: 5 ms for 200 Hz and 8 kHz.
inline constexpr double window_tick_s = 0.005;

/// Up to `count` different places at random on the tick, in the order drawn: the paper's "100
/// random samples without replacement", read as windows (S7). They overlap, so a split of them puts
/// the same instants on both sides. All samples of each lie in the recording.
std::vector<Place> random_places(const Recording& recording, double window_s, std::size_t count,
                                 std::uint64_t seed);

/// Places every `step_s` inside each of `blocks` equal parts of the recording, which begin at a
/// sample of each channel: windows of two blocks never share a sample.
std::vector<Place> block_places(const Recording& recording, double window_s, std::size_t blocks,
                                double step_s);

}  // namespace weft::classifier::vibro
