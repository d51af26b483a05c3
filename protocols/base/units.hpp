#pragma once
// Unit constants. Names carry units (force_n, speed_mps); these turn what people type into SI.

#include <numbers>

namespace weft {

constexpr double m_per_mm = 1e-3;
constexpr double m_per_um = 1e-6;
constexpr double rad_per_deg = std::numbers::pi / 180.0;
constexpr double standard_gravity_mps2 = 9.80665;  // CGPM 1901

}  // namespace weft
