#pragma once
// A recipe document to the values it states, in SI units. What needs more than one value (does the
// path fit the plate?) is looked at afterwards.

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "recipes/engine/plan.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

inline constexpr std::int64_t largest_seed = (std::int64_t{1} << 53) - 1;  ///< exact in JSON
inline constexpr std::int64_t most_repetitions = 100'000;
inline constexpr double least_speed_mps = 1e-6;
inline constexpr double least_leg_m = 1e-6;  ///< the stages' precision, paper section IV-A

/// As written: the start of a path may be left to the planner.
struct StatedExploration {
  Exploration exploration;
  std::optional<Vec2> start_m;
  std::string pointer;  ///< of the exploration
  /// Of phase M's path, or of a press that has none; empty when there is no usable one.
  std::string path_pointer;
};

enum class Order { blocked, randomised };

struct StatedRecipe : RecipeTerms {
  std::uint32_t repetitions = 0;
  Order order = Order::blocked;
  std::uint64_t order_seed = 1;
  std::vector<StatedExploration> explorations;
  bool declines_handover = false;  ///< "hand_over": false
};

/// Reads what is there; the result is complete only when no problem was added. `seed` takes the
/// place of the document's.
StatedRecipe read_recipe(const nlohmann::json& document, const RigLimits& limits,
                         std::optional<std::uint64_t> seed, Problems& problems);

// The parts of a recipe.

/// Reads the recipe's "classes", where it has them: the class of each of `fabrics`, or nothing.
/// Problems: fewer than two classes, a class without a fabric, a fabric that the recipe does not
/// have, has in two classes or in none.
std::vector<std::string> read_classes(ObjectReader& recipe, const std::vector<std::string>& fabrics,
                                      Problems& problems);

StatedExploration read_exploration(const std::string& name, const nlohmann::json& value,
                                   const std::string& pointer, const RigLimits& limits,
                                   Problems& problems);

/// Places are checked against the travel of the stages.
Finally read_finally(ObjectReader& recipe, const RigLimits& limits, Problems& problems);

/// What the recipe says a repetition is, if it says so. `document`: of the recipe.
void read_repetition(const nlohmann::json& document, ObjectReader& recipe, StatedRecipe& stated);

/// Of `repetitions`, which the pieces share in order.
std::uint32_t piece_of(std::uint32_t repetition, std::uint32_t repetitions, std::uint32_t pieces);

/// What cannot be done on this rig. The explorations must have been placed on the plate.
void check_repetition(const StatedRecipe& stated, const RigLimits& limits, Problems& problems);

/// Sets place and seeds of trials in their order of execution.
void assign_places(const StatedRecipe& stated, const RigLimits& limits,
                   std::vector<TrialSpec>& trials);

/// Warnings: patches that overlap, mountings that are fewer or more than the recipe seems to want.
std::vector<Diagnostic> warnings_about_places(const Plan& plan);

/// Where the exploration may start so that every corner keeps the face on the plate and the stages
/// in their travel: ranges along x and y [m]. Empty ones where it does not fit.
std::array<Range, 2> find_starts(const Exploration& exploration, const RigLimits& limits);

/// After the fabrics, which a step may name.
void read_operator_steps(ObjectReader& recipe, StatedRecipe& stated, Problems& problems);

/// Reads the sweep, where the recipe has one, and says of "repetitions", "order" and "hand_over"
/// that they do not go with it. The explorations must have been read.
void read_sweep(ObjectReader& recipe, const RigLimits& limits, StatedRecipe& stated,
                Problems& problems);

// What of a sweep can be done but not analysed.

/// What weft design analyse asks of every cell (docs/design.md, "What is compared"): its learner
/// leaves each of three replicates out, its spectrum wants 8 samples of phase M, its noise 3 of P.
inline constexpr std::size_t least_swept_fabrics = 2, least_swept_replicates = 3,
                             least_motion_samples = 8, least_press_samples = 3;

/// Warnings, not problems: a sweep may be done for its forces or imprints, which ask for less. One
/// for each exploration and reason, about its shortest cell. Nothing for a plan without a sweep.
std::vector<Diagnostic> warnings_about_sweep(const Plan& plan);

/// Sets start_m of the exploration. Every corner must keep the probe's whole face on the plate and
/// every stage within its travel; legs are straight and both regions are convex, so corners
/// suffice.
void place_on_plate(StatedExploration& stated, const RigLimits& limits, Problems& problems);

/// Puts every exploration in every cell: afterwards there is one for each cell of each, named
/// "M1-5N-2mm_s", with its values in the place of the phases' own. For a recipe without problems
/// whose explorations have been placed on the plate; a stroke that is swept is placed anew. Without
/// a sweep nothing happens.
void spread_sweep(StatedRecipe& stated, const RigLimits& limits, Problems& problems);

/// With the first value of each factor: what the phases state of a factor is of no account.
Exploration at_first_values(const Exploration& exploration, const Sweep& sweep);

/// Whether the sweep varies this.
bool varies(const Sweep& sweep, FactorKind kind);

}  // namespace weft::recipes
