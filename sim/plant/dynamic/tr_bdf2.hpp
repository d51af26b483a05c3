#pragma once
// Weights of TR-BDF2: a trapezium over the share gamma of the step, then backward differences over
// the rest. gamma = 2 - sqrt 2 gives both stages one implicit coefficient, gamma/2, and L-stability
// (Bank et al. 1985; Hosea and Shampine 1996).

#include <numbers>

namespace weft::sim::tr_bdf2 {

constexpr double share = 2 - std::numbers::sqrt2;
constexpr double implicit = share / 2;  ///< of the step, in both stages
/// y_1 = middle y_gamma - begin y_0 + implicit h f_1.
constexpr double middle = 1 / (share * (2 - share));
constexpr double begin = (1 - share) * (1 - share) / (share * (2 - share));

}  // namespace weft::sim::tr_bdf2
