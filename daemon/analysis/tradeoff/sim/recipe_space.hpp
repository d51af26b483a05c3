#pragma once
// The recipes and benches for measuring the errors of the simulation: a Latin hypercube of forces,
// speeds, paths, fabrics and mounts.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/fabric.hpp"
#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon {

enum class ScenePath : std::uint8_t { press, straight, corner, diagonal };

/// One trial of one fabric. A press uses the shortest slide that a recipe with a phase M permits.
struct RecipeScene {
  double force_n = 5;
  double speed_mps = 2e-3, approach_mps = 2e-3, seat_speed_mps = 0.5e-3;
  double press_s = 2;
  ScenePath path = ScenePath::straight;
  std::string fabric;
  double lambda_scale = 1;  ///< factor on the fabric's length lambda
  double mount_stiffness_n_m = 2e4;
  double slack_m = 1e-3;
};

/// Writes the ranges of the members as the table's conditions.
void write_ranges(sim::TableConditions& conditions);

/// `count` scenes. Every member is spread evenly over its range, with a fifth of the forces below
/// the probe's weight. Depends on the arguments only. `fabrics` must not be empty.
std::vector<RecipeScene> draw_recipe_scenes(const std::vector<std::string>& fabrics,
                                            double weight_n, std::size_t count, std::uint64_t seed);

/// Recipe, rig file and fabric table of a scene. The rig is `base_rig` with the scene's mount and
/// with its plate near the home position of the stages. It refers to "fabrics.json" beside it.
/// Errors: parse.
std::string scene_recipe(const RecipeScene& scene, std::uint64_t seed);
Result<std::string> scene_rig(std::string_view base_rig, const RecipeScene& scene);
Result<std::string> scene_fabrics(std::string_view fabrics_json, const RecipeScene& scene);

}  // namespace weft::daemon
