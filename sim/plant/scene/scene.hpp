#pragma once
// The needs of a scene, and the least level that provides them: a scene models only what it
// requires. Source: docs/reference/plant.md, Levels.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// Fidelity levels. A higher level has more mechanisms; it is not a smaller step of a lower one.
enum class Level : std::uint8_t {
  z,            ///< one static press: springs side by side (Winkler), exact by sorting
  z_plus,       ///< one static press: elastic half-space, neighbours coupled
  algebraic,    ///< L0: the force is the set point, pads are linear; no memory
  quasistatic,  ///< L1: balance without inertia, with relaxation, hysteresis, bristles
  dynamic,      ///< L2: the probe's inertia, LuGre friction, touch-down
  modal         ///< L3: L2 with resonances, for accelerometer and microphone
};

inline constexpr std::array all_levels{Level::z,           Level::z_plus,  Level::algebraic,
                                       Level::quasistatic, Level::dynamic, Level::modal};

/// "Z", "Z+", "L0" to "L3".
std::string_view to_string(Level level);
/// Errors: invalid_argument, with the names of the levels.
Result<Level> level_from(std::string_view text);

/// Levels that simulate a motion in time; the others compute one static press.
constexpr bool moves(Level level) {
  return level >= Level::algebraic;
}

/// Data of a sensor.
enum class Channel : std::uint8_t {
  stages,         ///< positions
  wrench,         ///< force and torque under the plate
  taxels,         ///< pad counts at 37 Hz
  accelerometer,  ///< three axes at 200 Hz and up
  microphone,     ///< sound pressure at 8 kHz and up
  imprint         ///< one static frame of a dense taxel array
};

/// Requirements on the use of a channel, beyond the channel itself.
enum class Trait : std::uint8_t {
  mean_level,       ///< averages over a phase
  relaxation,       ///< change under a held load
  regulated_force,  ///< effect of a force loop on the signal
  overshoot,        ///< at touch-down
  stick_slip,       ///< a limit cycle of friction
  neighbour_load    ///< load that a taxel takes off its neighbours
};

inline constexpr std::array all_traits{Trait::mean_level, Trait::relaxation, Trait::regulated_force,
                                       Trait::overshoot,  Trait::stick_slip, Trait::neighbour_load};

std::string_view to_string(Channel channel);
std::string_view to_string(Trait trait);

/// Name in files: "regulated_force".
std::string_view name_of(Trait trait);
/// Errors: invalid_argument, with the names of the traits.
Result<Trait> trait_from(std::string_view name);

struct Scene {
  std::string_view name;
  std::vector<Channel> channels;
  std::vector<Trait> traits;
};

/// Whether the scene has the channel.
bool is_needed(const Scene& scene, Channel channel);
bool is_needed(const Scene& scene, Trait trait);
/// "a wrench, taxel counts and a regulated force": all needs of the scene. Stage positions, which
/// every moving level has, are named only if there is nothing else.
std::string format_needs(const Scene& scene);

/// Whether a level computes it, at any accuracy.
bool provides(Level level, Channel channel);
bool provides(Level level, Trait trait);

/// The cheapest level that provides everything. Errors: unsupported, if no level does (an imprint
/// beside a moving sensor).
Result<Level> least_level(const Scene& scene);

/// Errors: unsupported, for a level that cannot produce a channel or trait of the scene; the text
/// names the first of them and the least level that can. Missing data is never invented.
Status check(const Scene& scene, Level level);

}  // namespace weft::sim
