#pragma once
// What the recordings say about each parameter at the minimum: an interval, or nothing.
//
// Blind directions: the Jacobian J of the residuals by central differences (2 % of the bounds'
// width); singular vectors whose value is below 1 % of the largest change nothing that is compared.
//
// Interval: the profile Q(theta_j), the minimum over the other parameters, where it exceeds the
// least Q by 3.84 (95 % of one parameter), times Q/(statistics - parameters) where that is above 1:
// a model that fits badly knows less. A full profile is a search at each point and too dear. Here
// the other parameters of the same block move by the Gauss-Newton step that J gives, and the lower
// Q of moved and unmoved counts, each computed by the scene: an upper bound of the profile. So an
// interval can be too short where the profile bends away from J, or through parameters of another
// block.

#include <optional>
#include <string>
#include <vector>

#include "daemon/analysis/calibration/objective.hpp"

namespace weft::daemon::calibration {

enum class Standing {
  estimated,   ///< not looked at, or a value without an interval
  calibrated,  ///< the interval is closed within the bounds
  bounded,     ///< on one side
  not_seen     ///< on none: the estimate stays
};
/// As the cloth table has it: "not_seen".
std::string_view to_string(Standing standing);

struct ParameterInterval {
  Standing standing = Standing::not_seen;
  double low = 0, high = 0;  ///< natural scale; a bound where it is not closed
};

struct Identifiability {
  std::vector<ParameterInterval> intervals;   ///< [parameter]
  std::vector<std::string> blind_directions;  ///< a sentence each
  double threshold = 0;                       ///< of Q above its minimum
};

/// At `values`, a minimum; `searched`: the parameters that were fitted there. Intervals of the
/// others are left at `estimated`. Errors: the scene's.
Result<Identifiability> identify(Objective& objective, const ClothModel& model,
                                 const std::vector<double>& values,
                                 const std::vector<std::size_t>& searched);

}  // namespace weft::daemon::calibration
