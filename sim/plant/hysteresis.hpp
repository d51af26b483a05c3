#pragma once
// Rate-independent hysteresis of compression. The factor on the elastic force runs between 1
// (loading curve, which is what KES prints) and (1 - eta)/(1 + eta) (unloading), so that a whole
// cycle has the resilience RC. The passage between the two is smooth in s = indentation/lambda: a
// Maxwell-slip element with one length.

#include "sim/plant/lanes.hpp"

namespace weft::sim {

struct Hysteresis {
  double eta = 0;       ///< 0 switches it off
  double length = 0.3;  ///< change of s over which 1 - 1/e of a reversal is done [E]
};

/// The branch after s has moved by `moved`: +1 loading, -1 unloading. `retained` =
/// e^{-|moved|/length}; exact for any step.
WEFT_SIM_INLINE double branch_after(double branch, double moved, double retained) {
  const double target = moved > 0 ? 1 : -1;
  return target + (branch - target) * retained;
}

inline double branch_factor(double branch, double eta) {
  return (1 + eta * branch) / (1 + eta);
}

}  // namespace weft::sim
