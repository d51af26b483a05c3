#pragma once
// The five stages and the plant with one time. The plant's state moves only on a fixed grid, the
// pads' conversion times. A request between grid points makes a step that is discarded. So the
// result does not depend on the order of requests.

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "protocols/base/time.hpp"
#include "sim/plant/contact.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/plant.hpp"
#include "sim/plant/stage.hpp"

namespace weft::sim {

/// The plant's grid: the ends of the pads' conversions and of their frames, nine points per frame.
struct GridPoint {
  std::uint64_t frame = 0;
  int stage = 0;  ///< 0 to 7: end of a conversion; 8: end of the frame

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

/// Motion of the stages under one mounted patch, on the plant's grid. It is the whole input of the
/// plant, so the same period can be simulated again at another fidelity.
struct BenchMotion {
  /// More than a day; later poses are not kept.
  static constexpr std::size_t most_poses = 30'000'000;

  Patch patch;
  std::optional<PlantMemory> memory;  ///< of earlier touches of the patch
  Pose mounted;                       ///< stage positions at mounting
  TimePoint mounted_at{};
  GridPoint first;          ///< the grid point of poses[0]
  std::vector<Pose> poses;  ///< one per grid point
};

enum class AxisId : std::uint8_t { x, y, z, rx, ry };
constexpr std::size_t axis_count = 5;

/// Converts stage readings to the fabric frame (docs/explanation/simulation.md, Frames and signs).
struct BenchGeometry {
  double origin_x_m = 0;  ///< stage positions with the probe over the fabric frame's origin
  double origin_y_m = 0;
  double probe_arm_m = 0;  ///< from the axis about which the probe turns down to its face
};

struct BenchPlantParams {
  std::array<StageParams, axis_count> stages;
  BenchGeometry geometry;
  PlantParams plant;
};

/// One finished scan of the pads.
struct PadFrame {
  std::uint64_t index = 0;  ///< since time zero
  std::array<std::uint16_t, pad_count> counts{};
};

class BenchPlant {
 public:
  BenchPlant(const BenchPlantParams& params, std::uint64_t seed);

  /// Moves the plant along its grid up to `now`. An earlier time than before has no effect.
  void advance_to(TimePoint now);
  /// Mounts another patch. If the piece is mounted as before (Patch::mounted), this is its next
  /// touch: the pads remember the earlier ones, and so does the fabric with `same_place`.
  void mount(const Patch& patch, TimePoint now, bool same_place = true);
  /// The stage after all events up to `now`. Plan its moves only through this.
  Stage& stage(AxisId axis, TimePoint now);
  [[nodiscard]] const Stage& stage(AxisId axis) const { return stages_[index(axis)]; }
  /// The contact at `now`, which must not be before the last advance.
  ContactState contact(TimePoint now);
  /// The last scan that was complete at `now`.
  const PadFrame& frame(TimePoint now);
  [[nodiscard]] const Plant& plant() const { return plant_; }
  /// The patch on the plate, and the number of changes or new touches of it.
  [[nodiscard]] const Patch& patch() const { return patch_; }
  [[nodiscard]] std::uint64_t mounts() const { return mounts_; }
  /// Readings of accelerometer and microphone since the last call, without a gap between patches;
  /// empty below level L3.
  VibrationReadings extract_vibration(TimePoint now);

  /// Starts or stops keeping the stages' motion, from the next mount() on.
  void record_motion(bool on) { record_motion_ = on; }
  /// The motion from the last mount() to now, if it was kept; keeping ends.
  std::optional<BenchMotion> extract_motion() { return std::exchange(motion_, std::nullopt); }

  /// Start of frame `frame`, and the first frame that starts at or after `t`.
  static TimePoint frame_start(std::uint64_t frame);
  static std::uint64_t frame_at_or_after(TimePoint t);

 private:
  static std::size_t index(AxisId axis) { return static_cast<std::size_t>(axis); }
  [[nodiscard]] Pose pose(TimePoint t);
  void step_grid();
  void drain_vibration(const Pose& there, TimePoint now);
  void gather_vibration();

  /// Sine and cosine of the last angle of the probe.
  struct Turned {
    double ry_rad = 0, sine = 0, cosine = 1;
  };

  BenchGeometry geometry_;
  Turned turned_;
  std::vector<Stage> stages_;
  Plant plant_;
  Patch patch_;
  std::uint64_t mounts_ = 1;    ///< the bare plate was the first
  bool listens_;                ///< the plant simulates vibrations
  VibrationReadings gathered_;  ///< from the plant, including earlier patches
  TimePoint plant_time_{};
  GridPoint next_;  ///< next grid point
  PadFrame finished_;
  bool record_motion_ = false;
  std::optional<BenchMotion> motion_;
};

}  // namespace weft::sim
