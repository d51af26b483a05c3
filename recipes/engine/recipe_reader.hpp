#pragma once
// Converts a recipe document to its stated values, in SI units. Checks that need more than one
// value (does the path fit the plate?) follow later.

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

/// An exploration as written: the start of its path may be left to the planner.
struct StatedExploration {
  Exploration exploration;
  std::optional<Vec2> start_m;
  std::string pointer;  ///< of the exploration
  /// Pointer of phase M's path, or of a press without path; empty if there is no usable one.
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

/// Reads the document; the result is complete only when no problem was added. `seed` replaces the
/// seed of the document.
StatedRecipe read_recipe(const nlohmann::json& document, const RigLimits& limits,
                         std::optional<std::uint64_t> seed, Problems& problems);

// The parts of a recipe.

/// Reads the recipe's "classes", if present: the class of each of `fabrics`, else empty. Problems:
/// fewer than two classes, a class without a fabric, an unknown fabric, and a fabric that is in two
/// classes or in none.
std::vector<std::string> read_classes(ObjectReader& recipe, const std::vector<std::string>& fabrics,
                                      Problems& problems);

StatedExploration read_exploration(const std::string& name, const nlohmann::json& value,
                                   const std::string& pointer, const RigLimits& limits,
                                   Problems& problems);

/// Positions are checked against the travel of the stages.
Finally read_finally(ObjectReader& recipe, const RigLimits& limits, Problems& problems);

/// Reads "repetition", if the recipe has it. `document`: the recipe.
void read_repetition(const nlohmann::json& document, ObjectReader& recipe, StatedRecipe& stated);

/// Piece of a repetition; the pieces share the `repetitions` in order.
std::uint32_t piece_of(std::uint32_t repetition, std::uint32_t repetitions, std::uint32_t pieces);

/// Adds problems of this rig with the repetition. The explorations must have been placed on the
/// plate.
void check_repetition(const StatedRecipe& stated, const RigLimits& limits, Problems& problems);

/// Sets place and seeds of trials in their order of execution.
void assign_places(const StatedRecipe& stated, const RigLimits& limits,
                   std::vector<TrialSpec>& trials);

/// Warnings: overlapping patches, and more or fewer mountings than the recipe seems to intend.
std::vector<Diagnostic> warnings_about_places(const Plan& plan);

/// Range of start points that keep the face on the plate at every corner and the stages in their
/// travel: along x and y [m]. Empty ranges if it does not fit.
std::array<Range, 2> find_starts(const Exploration& exploration, const RigLimits& limits);

/// Call after the fabrics are read, because a step may name them.
void read_operator_steps(ObjectReader& recipe, StatedRecipe& stated, Problems& problems);

/// Reads the sweep, if present, and reports "repetitions", "order" and "hand_over", which cannot be
/// combined with it. The explorations must have been read.
void read_sweep(ObjectReader& recipe, const RigLimits& limits, StatedRecipe& stated,
                Problems& problems);

// Sweeps that can be carried out but not analysed.

/// Requirements of `weft design analyse` for every cell (docs/explanation/campaign-design.md,
/// "Which cell"). Its learner holds out each of three replicates, its spectrum needs 8 samples of
/// phase M, its noise needs 3 of P.
inline constexpr std::size_t least_swept_fabrics = 2, least_swept_replicates = 3,
                             least_motion_samples = 8, least_press_samples = 3;

/// Warnings, not problems: a sweep may be for forces or imprints, which need less. There is one for
/// each exploration and reason, about its shortest cell. Empty for a plan without a sweep.
std::vector<Diagnostic> warnings_about_sweep(const Plan& plan);

/// Sets start_m of the exploration. Every corner must keep the probe's whole face on the plate and
/// every stage within its travel; legs are straight and both regions are convex, so corners
/// suffice.
void place_on_plate(StatedExploration& stated, const RigLimits& limits, Problems& problems);

/// Replaces each exploration with one per cell, named "M1-5N-2mm_s", with the values of the cell in
/// its phases. Requires a recipe without problems and explorations that have been placed on the
/// plate; a swept stroke or direction is placed anew. Does nothing without a sweep.
void spread_sweep(StatedRecipe& stated, const RigLimits& limits, Problems& problems);

/// The exploration with the first value of each factor; values stated in the phases are ignored.
/// Its path has the direction that the recipe states, which is the direction 0.
Exploration at_first_values(const Exploration& exploration, const Sweep& sweep);

/// Whether the sweep varies this factor.
bool varies(const Sweep& sweep, FactorKind kind);

}  // namespace weft::recipes
