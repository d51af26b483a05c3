#pragma once
// The information in the recordings about each parameter at the minimum: an interval, or none.
//
// Blind directions: the Jacobian J of the residuals by central differences (2 % of the bounds'
// width). Singular vectors with a value below 1 % of the largest change nothing that is compared.
//
// Interval: the profile Q(theta_j) is the minimum over the other parameters. Its limit is the least
// Q plus 3.84 (95 % for one parameter). The 3.84 is multiplied by Q/(statistics - parameters) if
// that exceeds 1: a worse fit gives a wider interval. A full profile needs a search at each point
// and is too expensive. Here the other parameters of the same block move by the Gauss-Newton step
// from J. The lower Q of moved and unmoved parameters counts, each computed by the scene: an upper
// bound of the profile. So an interval can be too short if the profile deviates from J, or through
// parameters of another block.

#include <optional>
#include <string>
#include <vector>

#include "daemon/analysis/calibration/objective.hpp"

namespace weft::daemon::calibration {

enum class Standing {
  estimated,   ///< not examined, or a value without an interval
  calibrated,  ///< the interval is closed within the bounds
  bounded,     ///< closed on one side
  not_seen     ///< open on both sides: the estimate is kept
};
/// As in the fabric table: "not_seen".
std::string_view to_string(Standing standing);

struct ParameterInterval {
  Standing standing = Standing::not_seen;
  double low = 0, high = 0;  ///< natural scale; a bound if not closed
};

struct Identifiability {
  std::vector<ParameterInterval> intervals;   ///< [parameter]
  std::vector<std::string> blind_directions;  ///< one sentence each
  double threshold = 0;                       ///< rise of Q above its minimum
};

/// `values` is a minimum; `searched`: the parameters fitted there. The intervals of the others stay
/// `estimated`. Errors: the scene's.
Result<Identifiability> identify(Objective& objective, const ClothModel& model,
                                 const std::vector<double>& values,
                                 const std::vector<std::size_t>& searched);

}  // namespace weft::daemon::calibration
