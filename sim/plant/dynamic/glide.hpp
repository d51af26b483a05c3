#pragma once
// One substep of the probe along x and y. The stages carry the plate, so that the probe's velocity
// in the room, v, is minus the rate of its lag u behind the stages:
//   m dv/dt = k_l u - c_l v - F(w),  du/dt = -v,  w = V + v
// with the stages' velocity V, the slip w over the cloth and LuGre's F (lugre.hpp).

#include "sim/plant/dynamic/lugre.hpp"

namespace weft::sim {

/// The guide along x and y.
struct GlideLaw {
  double mass_kg = 0.2;
  double stiffness_n_m = 1e5;  ///< k_l
  double damper_n_s_m = 0;     ///< c_l
};

struct GlideState {
  Vector2 lag_m{};
  Vector2 room_mps{};
  Vector2 bristle{};  ///< as in ContactState
};

/// Implicit midpoint with bristles that are exact for the slip at the substep's middle; `lugre`
/// belongs to the load there. Keeps the energy of an undamped probe that is off the cloth.
GlideState glide_midpoint(const GlideLaw& law, const LuGre& lugre, const GlideState& from,
                          const Vector2& stage_mps, double h_s);

/// TR-BDF2 for all three; the loads are those at its begin, inner stage and end.
GlideState glide_tr_bdf2(const GlideLaw& law, const LuGre& begin, const LuGre& middle,
                         const LuGre& end, const GlideState& from, const Vector2& stage_mps,
                         double h_s);

}  // namespace weft::sim
