#pragma once
// Level L0: once the face has reached the cloth, the force is the set-point. No memory, no
// controller, no pre-sliding; pads see the surface through a linear filter, their disc. Good for
// mean levels and periodicities of cloths whose surface is flat against lambda (2 % at a/lambda =
// 0.3, 27 % at 1). Source: docs/reference/plant.md, Pads on a surface and Levels.

#include "sim/plant/contact.hpp"
#include "sim/plant/texture_map.hpp"

namespace weft::sim {

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

}  // namespace weft::sim
