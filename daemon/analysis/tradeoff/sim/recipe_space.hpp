#pragma once
// The recipes and benches over which the errors of the simulation are measured: a Latin hypercube
// of forces, speeds, paths, cloths and mounts.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/fabric.hpp"
#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon {

enum class ScenePath : std::uint8_t { press, straight, corner, diagonal };

/// One trial of one cloth. A press slides by the shortest way that a recipe with a phase M has.
struct RecipeScene {
  double force_n = 5;
  double speed_mps = 2e-3, approach_mps = 2e-3, seat_speed_mps = 0.5e-3;
  double press_s = 2;
  ScenePath path = ScenePath::straight;
  std::string fabric;
  double lambda_scale = 1;  ///< of the cloth's length lambda
  double mount_stiffness_n_m = 2e4;
  double slack_m = 1e-3;
};

/// Ranges of the scenes' members, as the table's conditions state them.
void write_ranges(sim::TableConditions& conditions);

/// `count` scenes; every member is spread evenly over its range, a fifth of the forces below the
/// probe's weight. Depends on its arguments alone. `fabrics` is not empty.
std::vector<RecipeScene> draw_recipe_scenes(const std::vector<std::string>& fabrics,
                                            double weight_n, std::size_t count, std::uint64_t seed);

/// Recipe, rig file and cloth table of a scene. The rig is `base_rig` with the scene's mount, its
/// plate near where the stages home, and "fabrics.json" beside it as its cloth table.
/// Errors: parse.
std::string scene_recipe(const RecipeScene& scene, std::uint64_t seed);
Result<std::string> scene_rig(std::string_view base_rig, const RecipeScene& scene);
Result<std::string> scene_fabrics(std::string_view fabrics_json, const RecipeScene& scene);

}  // namespace weft::daemon
