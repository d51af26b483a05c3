#pragma once
// Level L0 on a bench: the probe in its mount. Within the slack the fabric carries the probe's
// weight, as in phase S. As soon as the mount pushes, the force is the set point, at once and
// exactly. A force loop therefore finds its set point without a transient. The effects of a
// controller, of the stiffness and of the relaxation of the fabric are not simulated.

#include "sim/plant/contact.hpp"
#include "sim/plant/texture_map.hpp"

namespace weft::sim {

// Level L0: once the face has reached the fabric, the force is the set point. There is no memory,
// no controller and no pre-sliding; pads read the surface through a linear filter, their disc. It
// is valid for mean levels and periodicities, if the surface of the fabric is flat against lambda.
// The error is 2 % at a/lambda = 0.3 and 27 % at 1. Source: docs/reference/plant.md, Pads on a
// surface and Levels.

/// Mean height under a pad's disc: each wave of the surface times 2 J1(k R)/(k R).
class LinearTexture {
 public:
  explicit LinearTexture(const HeightField& field);

  /// Height above the fabric's mean, at a point of the frame of the yarns [m].
  double height_m(double u_m, double v_m, TextureMap::Cursor& cursor);
  [[nodiscard]] std::size_t tiles() const { return map_.tiles(); }

 private:
  double scale_m_;
  TextureMap map_;
};

class AlgebraicContact {
 public:
  /// `set_point_n` >= 0 is the normal force of every pose that reaches the fabric.
  AlgebraicContact(const ContactGeometry& geometry, const ContactMaterial& material,
                   double set_point_n);

  /// The state at `to`. From `from` only the direction of the last motion is used, for the
  /// direction of friction while the probe does not move. A pose that is not `reachable` changes
  /// nothing.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& to) const;
  /// Pressure at an offset from the face's centre, linear in the local height; at least 0 [Pa].
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

  /// The state at `to`. `from` gives the direction of the last motion, and whether the probe was
  /// pressed. A pressed probe stays pressed until the stage has gone back by a quarter of the
  /// slack. Otherwise, with the loop at the border, every wave of the fabric would switch the
  /// force.
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
