#pragma once
// LuGre friction of a fabric in two dimensions: bristles that deflect before they slide, a static
// limit above the kinetic one, and a decrease between the two with speed. With b = z/l, the
// bristles' deflection in lengths of full sliding (the `bristle` of ContactState), sigma_0 = F_C/l
// and r(u) = g(u)/F_C = 1 + (F_S/F_C - 1) e^{-(u/v_s)^2},
//   l db/dt = v - |v| b/r,   F = F_C b + sigma_1 l db/dt + sigma_2 v.
// For a constant v the bristles have the closed form b(t) = r n + (b_0 - r n) e^{-|v| t/(l r)},
// with n the direction of v. Source: docs/reference/plant.md, Friction and Closed forms (5);
// Canudas de Wit et al. 1995 for the model. Known property of the model: under a load below the
// limit the bristles creep when the load oscillates, never when it is steady.

#include <cmath>
#include <numbers>

#include "sim/plant/fabric_law.hpp"

namespace weft::sim {

/// The fabric under one normal load.
struct LuGre {
  double kinetic_n = 0;        ///< F_C; 0: only sigma_2 acts
  double static_ratio = 1;     ///< F_S/F_C >= 1
  double stribeck_mps = 5e-3;  ///< v_s
  double length_m = 150e-6;    ///< l
  double damping_n_s_m = 0;    ///< sigma_1
  double viscous_n_s_m = 0;    ///< sigma_2

  /// r(u) = g/F_C at the speed `u_mps` >= 0.
  [[nodiscard]] double limit_ratio(double u_mps) const {
    const double x = u_mps / stribeck_mps;
    return 1 + (static_ratio - 1) * std::exp(-x * x);
  }
  /// db/dt [1/s].
  [[nodiscard]] Vector2 bristle_rate(const Vector2& bristle, const Vector2& v_mps) const;
  /// Force on the fabric, along the motion of the probe over it.
  [[nodiscard]] Vector2 force_n(const Vector2& bristle, const Vector2& v_mps) const;
};

/// Motion of the bristles within a step; both rules are functions of x = |v| t/(l r).
enum class BristleRule {
  exact,    ///< closed form at constant v; the step's force is the mean over it
  implicit  ///< end of an implicit Euler stage, for DIRK methods; the force is that at its end
};

/// A slip and the resulting bristles.
struct Slip {
  Vector2 w_mps{};
  Vector2 bristle{};
};

/// Solves a w + F(w; b, t) = q for the slip velocity w [m/s]. F is the friction force of a step of
/// t_s > 0 from the bristles b; a > 0 [N s/m] combines inertia, guide and spring. The force is
/// P(|w|) n + Q(|w|) b, which leaves one scalar equation for |w|:
///   a u + P(u) = |q - Q(u) b|.
/// `guess_mps` selects a root if decreasing friction gives several.
Slip solve_slip(const LuGre& lugre, BristleRule rule, double a_n_s_m, const Vector2& q_n,
                const Vector2& bristle, double t_s, double guess_mps);

/// Weights of TR-BDF2: a trapezium over the share gamma of the step, then backward differences over
/// the rest. gamma = 2 - sqrt 2 gives both stages one implicit coefficient, gamma/2, and
/// L-stability (Bank et al. 1985; Hosea and Shampine 1996).
namespace tr_bdf2 {
constexpr double share = 2 - std::numbers::sqrt2;
constexpr double implicit = share / 2;  ///< of the step, in both stages
/// y_1 = middle y_gamma - begin y_0 + implicit h f_1.
constexpr double middle = 1 / (share * (2 - share));
constexpr double begin = (1 - share) * (1 - share) / (share * (2 - share));
}  // namespace tr_bdf2

// One substep of the probe along x and y. The stages carry the plate. The probe's velocity v in the
// bench frame is therefore minus the rate of its lag u behind the stages:
//   m dv/dt = k_l u - c_l v - F(w),  du/dt = -v,  w = V + v
// with the stages' velocity V, the slip w over the fabric and LuGre's F.

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

/// Implicit midpoint with bristles that are exact for the slip at the middle of the substep;
/// `lugre` is for the load there. Preserves the energy of an undamped probe without contact.
GlideState glide_midpoint(const GlideLaw& law, const LuGre& lugre, const GlideState& from,
                          const Vector2& stage_mps, double h_s);

/// TR-BDF2 for all three; the loads are those at its begin, inner stage and end.
GlideState glide_tr_bdf2(const GlideLaw& law, const LuGre& begin, const LuGre& middle,
                         const LuGre& end, const GlideState& from, const Vector2& stage_mps,
                         double h_s);

}  // namespace weft::sim
