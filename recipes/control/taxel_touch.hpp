#pragma once
// Contact detection by the taxels, for a rig without a force sensor: the change of their counts
// since the probe hung free. Pure. Thread: the owner's.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace weft::recipes {

class TaxelTouch {
 public:
  /// Discards the baseline and starts a new one: all frames until settle() belong to it.
  void begin();
  /// Makes the mean of the frames since begin() the baseline. At least one frame is needed.
  void settle();
  /// Adds a frame of all taxels. A change of the number of taxels starts anew.
  void add(std::span<const std::uint16_t> counts);

  [[nodiscard]] std::size_t baseline_frames() const { return frames_; }
  /// Mean counts of the frames since begin(): largest minus smallest.
  [[nodiscard]] double baseline_spread() const { return frames_ == 0 ? 0 : most_ - least_; }
  /// Change of the newest frame against the baseline [counts], 0 until there is one: mean of
  /// |change| over the taxels, and the largest |change| of one. A taxel at 65535 counts as full
  /// scale.
  [[nodiscard]] double mean_change() const { return mean_change_; }
  [[nodiscard]] double largest_change() const { return largest_change_; }

 private:
  void gather(std::span<const std::uint16_t> counts);

  std::vector<double> baseline_;  ///< sums while it is collected, then means
  std::size_t frames_ = 0;
  double least_ = 0, most_ = 0;
  double mean_change_ = 0, largest_change_ = 0;
  bool settled_ = false;
};

}  // namespace weft::recipes
