#pragma once
// APT tables count in millimetres and degrees, the plant in metres and radians.

#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/units.hpp"

namespace weft::sim {

constexpr double si_per_unit(const protocols::apt::StageModel& model) {
  return model.axis == protocols::apt::Axis::linear ? m_per_mm : rad_per_deg;
}

}  // namespace weft::sim
