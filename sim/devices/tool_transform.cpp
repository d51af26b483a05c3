#include "sim/devices/tool_transform.hpp"

#include <Eigen/Geometry>

#include "protocols/rdt/tcp_command.hpp"

namespace weft::sim {

Result<ToolTransform> ToolTransform::create(const protocols::rdt::Configuration& of) {
  const auto metres = protocols::rdt::metres_per(static_cast<std::uint8_t>(of.distance_unit));
  if (!metres) return pass(metres.error());
  const auto radians = protocols::rdt::radians_per(static_cast<std::uint8_t>(of.angle_unit));
  if (!radians) return pass(radians.error());
  ToolTransform made;
  for (std::size_t i = 0; i < 3; ++i) {
    made.offset_m_[i] = of.tool_transform[i] * *metres;
    made.turn_rad_[i] = of.tool_transform[i + 3] * *radians;
  }
  return made;
}

Wrench ToolTransform::apply(const Wrench& sensed) const {
  if (none()) return sensed;
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Matrix3d frame =
      (AngleAxisd(turn_rad_[0], Vector3d::UnitX()) * AngleAxisd(turn_rad_[1], Vector3d::UnitY()) *
       AngleAxisd(turn_rad_[2], Vector3d::UnitZ()))
          .toRotationMatrix();
  const Vector3d force(sensed[0], sensed[1], sensed[2]);
  const Vector3d torque(sensed[3], sensed[4], sensed[5]);
  const Vector3d offset(offset_m_[0], offset_m_[1], offset_m_[2]);
  const Vector3d f = frame.transpose() * force;
  const Vector3d t = frame.transpose() * (torque - offset.cross(force));
  return {f.x(), f.y(), f.z(), t.x(), t.y(), t.z()};
}

}  // namespace weft::sim
