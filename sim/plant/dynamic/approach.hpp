#pragma once
// What a probe moves through during one step of the stages: their straight path, and the height at
// which its face would just touch the cloth, linear in time and in where the face is.

#include "sim/plant/contact.hpp"

namespace weft::sim {

struct Approach {
  double stage_z_m = 0;  ///< at the step's begin
  double stage_z_mps = 0;
  Vector2 stage_m{};        ///< x and y, as stage_z_m
  Vector2 stage_mps{};      ///< along x and y
  double touch_z_m = 0;     ///< z of the face's centre at first touch, at the step's begin
  double touch_mps = 0;     ///< its change with time for a face that keeps its lag
  Vector2 touch_per_lag{};  ///< its change with the face's lag [1]
  Vector2 lag_m{};          ///< lag to which the above belongs

  [[nodiscard]] double stage_at(double t_s) const { return stage_z_m + stage_z_mps * t_s; }
  [[nodiscard]] double touch_at(double t_s, const Vector2& lag) const {
    return touch_z_m + touch_mps * t_s + touch_per_lag[0] * (lag[0] - lag_m[0]) +
           touch_per_lag[1] * (lag[1] - lag_m[1]);
  }
};

}  // namespace weft::sim
