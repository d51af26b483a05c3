#include "sim/plant/algebraic/algebraic_probe.hpp"

namespace weft::sim {

namespace {

constexpr double held_share_of_slack = 0.25;

/// A probe that hangs at the slack's lower end touches this much earlier.
ContactGeometry hanging(ContactGeometry geometry, const Mount& mount) {
  geometry.plate_z_m -= mount.slack_m;
  return geometry;
}

}  // namespace

AlgebraicProbe::AlgebraicProbe(const ContactGeometry& geometry, const Mount& mount,
                               const ContactMaterial& material, double set_point_n)
    : slack_m_(mount.slack_m),
      set_point_n_(set_point_n),
      resting_(hanging(geometry, mount), material, mount.weight_n()),
      pressed_(hanging(geometry, mount), material, set_point_n) {}

ContactState AlgebraicProbe::step(const ContactState& from, const Pose& to) const {
  ContactState state = resting_.step(from, to);
  const double extension_m = state.extension_m - slack_m_;
  const bool was_pressed = from.normal_n == set_point_n_;
  const bool pressed =
      state.normal_n > 0 && extension_m >= (was_pressed ? -held_share_of_slack * slack_m_ : 0);
  if (pressed) state = pressed_.step(from, to);
  state.extension_m -= slack_m_;
  return state;
}

double AlgebraicProbe::pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                   double height_m) const {
  return pressed_.pressure_pa(state, dx_m, dy_m, height_m);
}

}  // namespace weft::sim
