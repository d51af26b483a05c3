#pragma once
// Touch by the taxels, for a rig without a force sensor: how far their counts are from where they
// were when the probe hung free. Pure; thread-bound to its owner.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace weft::recipes {

class TaxelTouch {
 public:
  /// Forgets the baseline and begins a new one: every frame until settle() belongs to it.
  void begin();
  /// The mean of the frames since begin() is the baseline from now on. There must be one.
  void settle();
  /// One frame of all taxels; another number of taxels than before begins anew.
  void add(std::span<const std::uint16_t> counts);

  [[nodiscard]] std::size_t baseline_frames() const { return frames_; }
  /// Of the frames' mean counts since begin(): largest less smallest.
  [[nodiscard]] double baseline_spread() const { return frames_ == 0 ? 0 : most_ - least_; }
  /// Of the newest frame against the baseline, 0 until there is one [counts]: |mean change| over
  /// the taxels, and the largest |change| of one; a taxel that reads 65535 counts as full
  /// scale.
  [[nodiscard]] double mean_change() const { return mean_change_; }
  [[nodiscard]] double largest_change() const { return largest_change_; }

 private:
  void gather(std::span<const std::uint16_t> counts);

  std::vector<double> baseline_;  ///< sums while it is gathered, then means
  std::size_t frames_ = 0;
  double least_ = 0, most_ = 0;
  double mean_change_ = 0, largest_change_ = 0;
  bool settled_ = false;
};

}  // namespace weft::recipes
