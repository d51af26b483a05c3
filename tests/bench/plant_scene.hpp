#pragma once
// The scene for the times of the levels: own weight (3 s), press to 5 N (6 s), a slide of 50 mm at
// 2 mm/s under 5 N (25 s), lift-off (2 s): docs/reference/plant.md, Levels. It has contact, texture
// and pads of one plant on the pads' own schedule, a stage with steps of a micrometre, and a loop
// at 37 Hz on a reading in steps of 20 mN; no wire protocols. SIMULATED throughout.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "sim/plant/plant.hpp"

namespace weft::bench {

inline constexpr double scene_s = 36.2;
inline constexpr double scene_plate_z_m = 0.06;

/// Quality of the loop, and a sum over all counts, so that the compiler cannot remove work.
struct SceneResult {
  double rms_error_n = 0;  ///< from the set point during the slide
  std::uint64_t counts = 0;
  std::size_t readings = 0;  ///< of the vibration sensors
};

inline sim::PlantParams scene_params(sim::Level level) {
  sim::PlantParams params;
  params.level = level;
  params.geometry.plate_z_m = scene_plate_z_m;
  params.geometry.tilt_axis_y_m = 0.075;
  params.mount.slack_m = 1e-3;
  return params;
}

class Scene {
 public:
  Scene(const sim::PlantParams& params, const sim::Patch& patch)
      : plant_(params, 1),
        height_m_(scene_plate_z_m - patch.material.thickness_m),
        z_m_(height_m_ - 2e-3) {
    plant_.mount(patch, {.x_m = 0.03, .y_m = 0.03, .z_m = z_m_});
  }

  /// Runs the whole scene once; a second run follows the same path over existing texture.
  SceneResult run() {
    SceneResult result;
    const auto frames = static_cast<std::uint64_t>(scene_s * 37);
    const double begin_m = height_m_ - 2e-3;
    double y_m = 0.03, squares = 0;
    std::uint64_t sliding = 0;
    z_m_ = begin_m;
    for (std::uint64_t i = 0; i < frames; ++i) {
      const double t_s = static_cast<double>(i) / 37;
      const double error_n = set_n - reading_n();
      const double z_mps = stage_speed_mps(t_s, error_n);
      const double y_mps = t_s >= 9 && t_s < 34 ? 2e-3 : 0;
      frame(y_m, y_mps, z_mps, result);
      y_m += y_mps * frame_s;
      z_m_ = std::max(begin_m, z_m_ + z_mps * frame_s);
      if (t_s < 10 || t_s >= 34) continue;
      squares += error_n * error_n;
      ++sliding;
    }
    result.rms_error_n = std::sqrt(squares / static_cast<double>(sliding));
    return result;
  }

 private:
  static constexpr double set_n = 5, reading_step_n = 0.02, quantum_m = 1e-6;
  static constexpr double slot_s = 3.072e-3, frame_s = 27'027'027e-9;

  [[nodiscard]] double reading_n() const {
    return reading_step_n * std::round(plant_.contact().normal_n / reading_step_n);
  }

  /// Moves down until the fabric carries the probe's weight, waits, presses to the set point, holds
  /// it, and lifts.
  [[nodiscard]] double stage_speed_mps(double t_s, double error_n) const {
    const double force_n = set_n - error_n;
    if (t_s >= 34) return -2e-3;
    if (t_s < 3) return force_n > 1.8 ? 0 : 1.5e-3;
    if (force_n < 2.5) return 0.5e-3;  // through the slack
    return std::clamp(2e-4 * error_n, -1e-3, 1e-3);
  }

  void frame(double y_m, double y_mps, double z_mps, SceneResult& result) {
    const auto pose = [&](double t_s) {
      const double z_m = z_m_ + z_mps * t_s;
      return sim::Pose{.x_m = 0.03,
                       .y_m = y_m + y_mps * t_s,
                       .z_m = quantum_m * std::round(z_m * (1 / quantum_m))};
    };
    double t_s = 0;
    for (int slot = 0; slot < sim::pad_timing::stages; ++slot) {
      t_s += slot_s;
      plant_.advance(pose(t_s), slot_s);
      plant_.convert(slot, frame_);
    }
    plant_.advance(pose(frame_s), frame_s - sim::pad_timing::stages * slot_s);
    for (const std::uint16_t count : plant_.pad_counts()) result.counts += count;
    const sim::VibrationReadings received = plant_.extract_vibration();
    result.readings += received.acceleration.size() + received.sound.size();
    ++frame_;
  }

  sim::Plant plant_;
  double height_m_, z_m_;
  std::uint64_t frame_ = 0;
};

}  // namespace weft::bench
