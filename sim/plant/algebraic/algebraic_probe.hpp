#pragma once
// Level L0 on a bench: the probe in its mount. Within the slack the cloth carries the probe's
// weight, as in phase S; as soon as the mount begins to push, the force is the set point, at once
// and exactly. So a force loop finds its set point without a transient: what a controller does, how
// stiff the cloth is and how it relaxes is not there to be seen.

#include "sim/plant/algebraic/algebraic_contact.hpp"

namespace weft::sim {

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
