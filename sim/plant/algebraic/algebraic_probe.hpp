#pragma once
// Level L0 on a bench: the probe in its mount. Within the slack the cloth carries the probe's
// weight, as in phase S; as soon as the mount begins to push, the force is the set point, at once
// and exactly. So a force loop finds its set point without a transient: what a controller does, how
// stiff the cloth is and how it relaxes is not there to be seen.

#include "sim/plant/contact.hpp"
#include "sim/plant/texture_map.hpp"

namespace weft::sim {

// Level L0: once the face has reached the cloth, the force is the set-point. No memory, no
// controller, no pre-sliding; pads see the surface through a linear filter, their disc. Good for
// mean levels and periodicities of cloths whose surface is flat against lambda (2 % at a/lambda =
// 0.3, 27 % at 1). Source: docs/reference/plant.md, Pads on a surface and Levels.

/// Mean height under a pad's disc: each wave of the surface times 2 J1(k R)/(k R).
class LinearTexture {
 public:
  explicit LinearTexture(const HeightField& field);

  /// Above the cloth's mean, at a point of the yarns' frame [m].
  double height_m(double u_m, double v_m, TextureMap::Cursor& cursor);
  [[nodiscard]] std::size_t tiles() const { return map_.tiles(); }

 private:
  double scale_m_;
  TextureMap map_;
};

class AlgebraicContact {
 public:
  /// `set_point_n` >= 0 is the normal force of every pose that reaches the cloth.
  AlgebraicContact(const ContactGeometry& geometry, const ContactMaterial& material,
                   double set_point_n);

  /// The state at `to`: of `from` only the direction of the last motion is used, and that only to
  /// know where friction points while the probe stands. A pose that is not `reachable` changes
  /// nothing.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& to) const;
  /// Pressure at an offset from the face's centre, linear in the local height; not below 0 [Pa].
  [[nodiscard]] double pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                   double height_m) const;

 private:
  ContactModel statics_;
  ContactGeometry geometry_;
  ContactMaterial material_;
  double set_point_n_;
};

class AlgebraicProbe {
 public:
  /// `set_point_n` > 0.
  AlgebraicProbe(const ContactGeometry& geometry, const Mount& mount,
                 const ContactMaterial& material, double set_point_n);

  /// The state at `to`. Of `from`: the direction of the last motion, and whether the probe was
  /// pressed. A pressed probe stays so until the stage has gone back by a quarter of the slack, or
  /// a loop that stands on the border would switch the force with every wave of the cloth.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& to) const;
  /// As AlgebraicContact::pressure_pa.
  [[nodiscard]] double pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                   double height_m) const;

 private:
  double slack_m_;
  double set_point_n_;
  AlgebraicContact resting_, pressed_;
};

}  // namespace weft::sim
