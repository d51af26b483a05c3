#pragma once
// A tactile array of another shape or rate than the plant's 4 x 4 pads. Each taxel interpolates the
// pads around it (bilinear) and the last two scans in time, with its own noise. The plant's
// pressure field is no finer than its pads: this only gives data of the right shape and rate.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/devices/bench_plant.hpp"

namespace weft::sim {

/// Position of a taxel on the probe's face, from its middle [m].
struct TaxelPlace {
  double x_m = 0;
  double y_m = 0;
};

/// Evenly over the square of the plant's pads, row by row along x.
std::vector<TaxelPlace> taxel_grid(std::size_t rows, std::size_t cols);

class PadResampler {
 public:
  PadResampler(const std::vector<TaxelPlace>& places, double noise_counts, std::uint64_t seed);

  /// The counts at `at`; `newest` is the plant's newest complete scan, `frame` the number of the
  /// array's own frame. Between two scans of the plant the reading is one scan late.
  void sample(const PadFrame& newest, TimePoint at, std::uint64_t frame,
              std::span<std::uint16_t> counts);
  [[nodiscard]] std::size_t taxels() const { return mixes_.size(); }

 private:
  /// Four pads and their weights, which sum to 1.
  struct Mix {
    std::array<std::size_t, 4> pad{};
    std::array<double, 4> share{};
  };
  static Mix mix_at(const TaxelPlace& place);

  std::vector<Mix> mixes_;
  double noise_counts_;
  std::uint64_t seed_;
  PadFrame before_, newest_;
  bool begun_ = false;
};

}  // namespace weft::sim
