#pragma once
// Level L1 of the probe on the cloth: quasi-static with memory. One scalar balance per step,
//   weight + mount force = cloth force,
// no inertia. Source: docs/reference/plant.md, Contact law and Integrators.

#include <array>
#include <limits>

#include "sim/plant/fabric_law.hpp"
#include "sim/plant/height_field.hpp"
#include "sim/plant/near.hpp"
#include "sim/plant/pose.hpp"

namespace weft::sim {

constexpr double largest_pad_pressure_pa = 1e12;  ///< that a pad is told

/// The cloth as the contact sees it.
struct ContactMaterial {
  FabricLaw law = bare_plate_law();  ///< its `hysteresis` is used through the Hysteresis below
  double thickness_m = 0;
  Relaxation relaxation;
  Hysteresis hysteresis;
  Friction friction;
  Waviness waviness;
};

/// What stays when the cloth is changed.
struct ContactGeometry {
  double plate_z_m = 0;             ///< z stage reading with the probe's face on the bare plate
  double face_half_width_m = 8e-3;  ///< 4 x 4 pads at 4 mm: 16 x 16 mm
  double tilt_axis_y_m = 0;         ///< where the plate's axis of rotation rx is
  double tilt_axis_depth_m = 0;     ///< how far it lies under the plate's surface
  double tilt_x = 0;  ///< slope of the face against its guide along x at rx = ry = 0 [E]
  double tilt_y = 0;
  /// How the plate lies on its platform [rad]: x > 0 raises it at larger y, as rx does; y > 0 at
  /// larger x, as ry does the face. rx = -x and ry = y make plate and face parallel.
  double plate_tilt_x_rad = 0;
  double plate_tilt_y_rad = 0;
  double plate_centre_x_m = 0;  ///< with plate_z_m where x meets the axis of rx: plate_tilt pivots

  [[nodiscard]] double face_area_m2() const { return 4 * face_half_width_m * face_half_width_m; }
  /// Rise of the plate per metre along x and y, in the room.
  [[nodiscard]] Vector2 plate_slope(const Pose& pose) const;
  /// Rise of the plate at a point of the room over plate_z_m [m].
  [[nodiscard]] double plate_rise_m(const Pose& pose) const {
    return plate_rise_m(pose, plate_slope(pose));
  }
  /// The same where plate_slope() is known.
  [[nodiscard]] double plate_rise_m(const Pose& pose, const Vector2& plate_slope) const;
  /// Extra indentation of the face per metre along x and y.
  [[nodiscard]] Vector2 face_slope(const Pose& pose) const {
    return face_slope(pose, plate_slope(pose));
  }
  [[nodiscard]] Vector2 face_slope(const Pose& pose, const Vector2& plate_slope) const;
};

/// State at the end of a step, and what follows from it.
struct ContactState {
  Pose pose;
  double exponent = -1e9;  ///< s = (indentation + waviness)/lambda + ln(tilt average); > 0 touches
  double growth = 1;       ///< e^exponent while it touches, 1 above the cloth
  double branch = -1;      ///< of the hysteresis
  RelaxationState relaxation;
  Vector2 bristle{};         ///< share of full sliding, |.| <= 1
  double normal_n = 0;       ///< cloth's force on the face, >= 0
  double indentation_m = 0;  ///< of the face's centre into the mean surface; negative above it
  double extension_m = 0;    ///< of the mount, z_stage - z_probe
  double load_ratio =
      0;               ///< normal force / elastic loading force: memory of the cloth, 0 untouched
  double slope_x = 0;  ///< of the face against the cloth: extra indentation per metre along x
  double slope_y = 0;
  Vector2 plate_slope{};  ///< in the room; kept at level L1 with
  double log_tilt =       ///< ln of the average of e^{slope r/lambda} over the face; NaN: not known
      std::numeric_limits<double>::quiet_NaN();
  double sliding_n = 0;  ///< friction of full sliding under the normal force, kept at level L1
  Vector2 friction_n{};  ///< force on the cloth along the fabric frame's axes
  Vector2 lag_m{};       ///< of the probe's face behind the stages; 0 at level L1
  /// Of the probe in the room, which is not where the plate is at rest: x and y are minus the rate
  /// of the lag. 0 at level L1.
  std::array<double, 3> velocity_mps{};

  [[nodiscard]] double probe_z_m() const { return pose.z_m - extension_m; }
  /// Where the face's centre is over the cloth.
  [[nodiscard]] double face_x_m() const { return pose.x_m - lag_m[0]; }
  [[nodiscard]] double face_y_m() const { return pose.y_m - lag_m[1]; }
};

/// Immutable law of motion; states are values, so that a step can be tried and thrown away.
class ContactModel {
 public:
  ContactModel(const ContactGeometry& geometry, const Mount& mount, const ContactMaterial& material)
      : geometry_(geometry), mount_(mount), material_(material) {}

  /// The state `dt_s` later with the stages at `pose`, moved there in a straight line. A pose that
  /// is not `reachable` and a dt_s that is negative or not finite change nothing.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& pose, double dt_s) const;
  /// The same in place and for steps of one length, whose relaxation need not be worked out each
  /// time.
  void advance(ContactState& state, const Pose& pose, const RelaxationStep& relaxation) const;
  /// Pressure on the cloth at an offset from the face's centre [Pa], for a
  /// local texture response `texture` = e^{h/lambda}/<e^{h/lambda}>.
  [[nodiscard]] double pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                   double texture) const;

  /// Height of the cloth's mean surface under a face at `pose`, downwards, in the z stage's scale.
  [[nodiscard]] double surface_z_m(const Pose& pose) const {
    return surface_z_m(pose, geometry_.plate_slope(pose));
  }

  [[nodiscard]] const ContactMaterial& material() const { return material_; }

 private:
  struct Balance;
  [[nodiscard]] double surface_z_m(const Pose& pose, const Vector2& plate_slope) const;
  WEFT_SIM_INLINE void lean(ContactState& state, const Pose& pose) const;
  WEFT_SIM_INLINE void press(ContactState& state, const RelaxationStep& relaxation,
                             double surface_z_m, double at_touch_m) const;
  void hang(ContactState& state, const RelaxationStep& relaxation, double surface_z_m,
            double log_average) const;
  struct Before;
  WEFT_SIM_INLINE void slide(ContactState& state, const Before& before) const;

  ContactGeometry geometry_;
  Mount mount_;
  ContactMaterial material_;
  // What every step would divide by.
  double per_lambda_ = 1 / material_.law.lambda_m;
  double top_n_ = geometry_.face_area_m2() * material_.law.pressure_pa;  // per unit of e^s - 1
  double per_length_ = 1 / material_.hysteresis.length;
  double turn_ = material_.hysteresis.eta / (1 + material_.hysteresis.eta);
  NearPower power_{material_.friction.exponent};  ///< of a change in load
};

/// ln(sinh(x)/x): average of e^{x t} over t in [-1, 1], safe for any finite x.
inline double log_sinhc(double x) {
  const double a = std::abs(x);
  if (!(a < 0.25)) return a + std::log(-std::expm1(-2 * a) / (2 * a));
  const double b = a * a;  // what is left out is below 1e-16
  return b * (1.0 / 6 -
              b * (1.0 / 180 -
                   b * (1.0 / 2835 -
                        b * (1.0 / 37800 - b * (1.0 / 467775 - b * (691.0 / 3831077250.0))))));
}

}  // namespace weft::sim
