#pragma once
// A recipe document to the values it states, in SI units. What needs more than one value (does the
// path fit the plate?) is looked at afterwards, in layout.hpp.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "recipes/engine/plan.hpp"
#include "recipes/schema/diagnostic.hpp"

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

struct StatedRecipe {
  std::string name;
  std::uint64_t seed = 1;
  std::vector<std::string> fabrics;
  std::vector<std::string> class_of;  ///< of each fabric; empty: there are no classes
  std::uint32_t repetitions = 0;
  Order order = Order::blocked;
  std::uint64_t order_seed = 1;
  std::vector<StatedExploration> explorations;
  Approach approach;
  Settle settle;
  OnTrialFailure on_trial_failure = OnTrialFailure::stop;
  std::optional<RepeatBad> repeat_bad;
  std::vector<OperatorStep> operator_steps;
  Finally finally;
  std::optional<Handover> handover;
  std::optional<Sweep> sweep;
  double mount_timeout_s = 600;
};

/// Reads what is there; the result is complete only when no problem was added. `seed` takes the
/// place of the document's.
StatedRecipe read_recipe(const nlohmann::json& document, const RigLimits& limits,
                         std::optional<std::uint64_t> seed, Problems& problems);

}  // namespace weft::recipes
