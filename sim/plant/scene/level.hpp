#pragma once
// The ladder of fidelity. A higher level knows more mechanisms; it is not a smaller step of a lower
// one. Source: docs/reference/plant.md, Levels.

#include <array>
#include <cstdint>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::sim {

enum class Level : std::uint8_t {
  z,            ///< one static press: springs side by side (Winkler), exact by sorting
  z_plus,       ///< one static press: elastic half-space, neighbours coupled
  algebraic,    ///< L0: the force is the set-point, pads are linear; no memory
  quasistatic,  ///< L1: balance without inertia, with relaxation, hysteresis, bristles
  dynamic,      ///< L2: the probe's inertia, LuGre friction, touch-down
  modal         ///< L3: L2 with resonances, for accelerometer and microphone
};

inline constexpr std::array all_levels{Level::z,           Level::z_plus,  Level::algebraic,
                                       Level::quasistatic, Level::dynamic, Level::modal};

/// "Z", "Z+", "L0" to "L3".
std::string_view to_string(Level level);
/// Errors: invalid_argument, naming the levels.
Result<Level> level_from(std::string_view text);

/// Levels that simulate a motion in time; the others press once and stand still.
constexpr bool moves(Level level) {
  return level >= Level::algebraic;
}

}  // namespace weft::sim
