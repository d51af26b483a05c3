#pragma once
// A tool transform of a Net F/T box: forces told from another origin, in another frame.

#include <array>

#include "protocols/rdt/page.hpp"
#include "sim/devices/ft_sensor.hpp"

namespace weft::sim {

/// The new origin lies `offset_m` from the sensor's, along the sensor's axes; the frame is then
/// turned about its own x, then its y, then its z axis. This order is from memory.
class ToolTransform {
 public:
  ToolTransform() = default;
  /// Errors: unsupported, for a unit that the box does not have.
  static Result<ToolTransform> create(const protocols::rdt::Configuration& of);

  [[nodiscard]] bool none() const { return *this == ToolTransform{}; }
  [[nodiscard]] Wrench apply(const Wrench& sensed) const;

  bool operator==(const ToolTransform&) const = default;

 private:
  std::array<double, 3> offset_m_{};
  std::array<double, 3> turn_rad_{};
};

}  // namespace weft::sim
