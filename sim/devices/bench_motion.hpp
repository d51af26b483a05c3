#pragma once
// How the stages moved under one mounted patch, on the plant's grid: all that the plant was given,
// so that the same minutes can be simulated again at another fidelity.

#include <cstdint>
#include <vector>

#include "protocols/base/time.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/pose.hpp"

namespace weft::sim {

/// The plant's grid: the ends of the pads' conversions and of their frames, nine points a frame.
struct GridPoint {
  std::uint64_t frame = 0;
  int stage = 0;  ///< 0 to 7 end a conversion, 8 ends the frame

  [[nodiscard]] bool ends_frame() const { return stage == pad_timing::stages; }
  [[nodiscard]] TimePoint time() const {
    const auto start_ns = static_cast<std::int64_t>(frame) * pad_timing::frame_ns;
    return TimePoint(Duration(ends_frame() ? start_ns + pad_timing::frame_ns
                                           : start_ns + (stage + 1) * pad_timing::stage_ns));
  }
  void advance() {
    stage = ends_frame() ? 0 : stage + 1;
    frame += stage == 0 ? 1 : 0;
  }
};

struct BenchMotion {
  /// More than a day; what comes later is not kept.
  static constexpr std::size_t most_poses = 30'000'000;

  Patch patch;
  Pose mounted;  ///< stages when the patch was put on
  TimePoint mounted_at{};
  GridPoint first;          ///< the grid point of poses[0]
  std::vector<Pose> poses;  ///< one for each grid point
};

}  // namespace weft::sim
