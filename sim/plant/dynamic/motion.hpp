#pragma once
// State of DynamicContact within a step of the stages; used only by its own sources.

#include <algorithm>
#include <cmath>

#include "sim/plant/dynamic/dynamic_contact.hpp"

namespace weft::sim {

inline constexpr double most_substeps = 1e8;  // in one step of the stages
inline constexpr double longest_ease = 16;    // times step_s, of the adaptive integrator

/// A substep's length and the relaxation over its two parts.
struct DynamicContact::Span {
  double h_s;
  RelaxationStep first, second;

  Span(const Relaxation& relaxation, double length_s, double first_share)
      : h_s(length_s),
        first(relaxation, first_share * length_s),
        second(relaxation, (1 - first_share) * length_s) {}
  [[nodiscard]] static double first_share(Integrator integrator) {
    return integrator == Integrator::tr_bdf2 ? tr_bdf2::share : 0.5;
  }
};

/// Equal substeps of at most `step_s` over a part of the stages' step.
struct DynamicContact::Leg {
  double substeps;
  Span span;

  Leg(const Relaxation& relaxation, Integrator integrator, double length_s, double step_s)
      : substeps(whole(length_s / step_s)),
        span(relaxation, length_s / substeps, Span::first_share(integrator)) {}
  /// Number of parts of one unit that cover `units`.
  [[nodiscard]] static double whole(double units) {
    return std::clamp(std::ceil(units * (1 - 1e-12)), 1.0, most_substeps);
  }
};

/// State within a step of the stages.
struct DynamicContact::Motion {
  double z_m, v_mps;
  PressMemory memory;
  bool touching;
  double normal_n;
  GlideState glide;
  NearPower power;  ///< of the load, for the friction
};

/// Result of a substep along z: the motion at its end, the load at its inner stage and end.
struct DynamicContact::Pressed {
  double z_m, v_mps;
  PressMemory memory;
  double inner_normal_n, normal_n;
};

}  // namespace weft::sim
