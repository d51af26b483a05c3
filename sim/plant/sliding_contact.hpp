#pragma once
// The contact at one instant, as sensors see it that are faster than the stages.

#include "sim/plant/vector2.hpp"

namespace weft::sim {

struct SlidingContact {
  Vector2 place_m{};         ///< of the face's centre over the cloth, fabric frame
  Vector2 friction_n{};      ///< on the cloth
  double normal_n = 0;       ///< cloth's force on the face, >= 0
  double stiffness_n_m = 0;  ///< dF/d(indentation) of the whole face there
};

}  // namespace weft::sim
