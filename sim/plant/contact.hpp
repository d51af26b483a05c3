#pragma once
// Level L1 of the probe on the fabric: quasi-static with memory. One scalar balance per step,
//   weight + mount force = fabric force,
// without inertia. Source: docs/reference/plant.md, Contact law and Integrators.

#include <array>
#include <cmath>
#include <limits>

#include "protocols/base/time.hpp"
#include "sim/plant/fabric_law.hpp"
#include "sim/plant/height_field.hpp"
#include "sim/plant/near.hpp"

namespace weft::sim {

/// The probe's mount. The probe rides in a guide on the z stage. It can be pushed up against a
/// spring (the compliance of sensor and mount). Inside a slack it rests freely; below the slack it
/// hangs on a stop. Inside the slack the stage does not change the force: the fabric carries the
/// probe's own weight, which is phase S of Khan et al. 2016.
struct Mount {
  double mass_kg = 0.2;             ///< [E]
  double stiffness_n_m = 2e4;       ///< k_c, series compliance [E]
  double slack_m = 0.5e-3;          ///< [E]
  double stop_stiffness_n_m = 2e5;  ///< of the stop on which the probe hangs [E]

  [[nodiscard]] double weight_n() const { return mass_kg * standard_gravity_mps2; }

  /// Force of the mount on the probe, downwards, at `extension_m` = z_stage - z_probe.
  [[nodiscard]] double force_n(double extension_m) const {
    if (extension_m > 0) return stiffness_n_m * extension_m;
    if (extension_m >= -slack_m) return 0;
    return stop_stiffness_n_m * (extension_m + slack_m);
  }
  [[nodiscard]] double slope_n_m(double extension_m) const {
    if (extension_m > 0) return stiffness_n_m;
    return extension_m >= -slack_m ? 0 : stop_stiffness_n_m;
  }
  /// Extension of a freely hanging probe.
  [[nodiscard]] double hanging_extension_m() const {
    return -slack_m - weight_n() / stop_stiffness_n_m;
  }
};

/// All five axes of the bench at one instant, in the fabric frame. Frames:
/// docs/explanation/simulation.md.
struct Pose {
  double x_m = 0;  ///< fabric frame: centre of the probe's face
  double y_m = 0;
  double z_m = 0;     ///< z stage, downwards, from its home
  double rx_rad = 0;  ///< plate about the fabric frame's x axis; > 0 raises the plate at larger y
  double ry_rad = 0;  ///< probe about the fabric frame's y axis; > 0 raises the face at larger x

  friend bool operator==(const Pose&, const Pose&) = default;
};

/// False for a pose that no stage can reach: NaN, infinity, beyond 1 km or 1000 rad. Models ignore
/// such a pose.
inline bool reachable(const Pose& pose) {
  const auto near = [](double x) { return std::abs(x) <= 1e3; };
  return near(pose.x_m) && near(pose.y_m) && near(pose.z_m) && near(pose.rx_rad) &&
         near(pose.ry_rad);
}

/// The pose after the fraction `share` of the straight way from `a` to `b`.
constexpr Pose between(const Pose& a, const Pose& b, double share) {
  const auto on_way = [share](double from, double to) { return from + share * (to - from); };
  return {.x_m = on_way(a.x_m, b.x_m),
          .y_m = on_way(a.y_m, b.y_m),
          .z_m = on_way(a.z_m, b.z_m),
          .rx_rad = on_way(a.rx_rad, b.rx_rad),
          .ry_rad = on_way(a.ry_rad, b.ry_rad)};
}

constexpr double largest_pad_pressure_pa = 1e12;  ///< upper limit of a pad's pressure

/// The fabric as the contact model uses it.
struct ContactMaterial {
  FabricLaw law = bare_plate_law();  ///< its `hysteresis` is used through the Hysteresis below
  double thickness_m = 0;
  Relaxation relaxation;
  Hysteresis hysteresis;
  Friction friction;
  Waviness waviness;
};

/// Constants that do not change with the fabric.
struct ContactGeometry {
  double plate_z_m = 0;             ///< z stage reading with the probe's face on the bare plate
  double face_half_width_m = 8e-3;  ///< 4 x 4 pads at 4 mm: 16 x 16 mm
  double tilt_axis_y_m = 0;         ///< position of the plate's axis of rotation rx
  double tilt_axis_depth_m = 0;     ///< depth of that axis below the surface of the plate
  double tilt_x = 0;  ///< slope of the face against its guide along x at rx = ry = 0 [E]
  double tilt_y = 0;
  /// Tilt of the plate on its platform [rad]: x > 0 raises it at larger y, as rx does; y > 0 at
  /// larger x, as ry does the face. rx = -x and ry = y make plate and face parallel.
  double plate_tilt_x_rad = 0;
  double plate_tilt_y_rad = 0;
  double plate_centre_x_m = 0;  ///< plate_tilt pivots at this x (on the axis of rx) and plate_z_m

  [[nodiscard]] double face_area_m2() const { return 4 * face_half_width_m * face_half_width_m; }
  /// Rise of the plate per metre along x and y, in the bench frame.
  [[nodiscard]] Vector2 plate_slope(const Pose& pose) const;
  /// Rise of the plate above plate_z_m at a point of the bench frame [m].
  [[nodiscard]] double plate_rise_m(const Pose& pose) const {
    return plate_rise_m(pose, plate_slope(pose));
  }
  /// The same for a known plate_slope().
  [[nodiscard]] double plate_rise_m(const Pose& pose, const Vector2& plate_slope) const;
  /// Extra indentation of the face per metre along x and y.
  [[nodiscard]] Vector2 face_slope(const Pose& pose) const {
    return face_slope(pose, plate_slope(pose));
  }
  [[nodiscard]] Vector2 face_slope(const Pose& pose, const Vector2& plate_slope) const;
};

/// State at the end of a step, and quantities derived from it.
struct ContactState {
  Pose pose;
  double exponent = -1e9;  ///< s = (indentation + waviness)/lambda + ln(tilt average); > 0: contact
  double growth = 1;       ///< e^exponent in contact, 1 above the fabric
  double branch = -1;      ///< of the hysteresis
  RelaxationState relaxation;
  Vector2 bristle{};         ///< share of full sliding, |.| <= 1
  double normal_n = 0;       ///< force of the fabric on the face, >= 0
  double indentation_m = 0;  ///< of the face's centre into the mean surface; negative above it
  double extension_m = 0;    ///< of the mount, z_stage - z_probe
  double load_ratio =
      0;  ///< normal force / elastic loading force: memory of the fabric, 0 without contact
  double slope_x = 0;  ///< of the face against the fabric: extra indentation per metre along x
  double slope_y = 0;
  Vector2 plate_slope{};  ///< in the bench frame; set at level L1 together with log_tilt
  double log_tilt =       ///< ln of the average of e^{slope r/lambda} over the face; NaN: unknown
      std::numeric_limits<double>::quiet_NaN();
  double sliding_n = 0;  ///< friction of full sliding under the normal force, set at level L1
  Vector2 friction_n{};  ///< force on the fabric along the fabric frame's axes
  Vector2 lag_m{};       ///< lag of the probe's face behind the stages; 0 at level L1
  /// Velocity of the probe in the bench frame: x and y are minus the rate of the lag. 0 at level
  /// L1.
  std::array<double, 3> velocity_mps{};

  [[nodiscard]] double probe_z_m() const { return pose.z_m - extension_m; }
  /// Position of the face's centre over the fabric.
  [[nodiscard]] double face_x_m() const { return pose.x_m - lag_m[0]; }
  [[nodiscard]] double face_y_m() const { return pose.y_m - lag_m[1]; }
};

/// Immutable law of motion. States are values, so that a step can be tried and discarded.
class ContactModel {
 public:
  ContactModel(const ContactGeometry& geometry, const Mount& mount, const ContactMaterial& material)
      : geometry_(geometry), mount_(mount), material_(material) {}

  /// The state `dt_s` later with the stages at `pose`, moved there in a straight line. A pose that
  /// is not `reachable` and a dt_s that is negative or not finite change nothing.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& pose, double dt_s) const;
  /// The same in place, for steps of one length with a precomputed relaxation.
  void advance(ContactState& state, const Pose& pose, const RelaxationStep& relaxation) const;
  /// Pressure on the fabric at an offset from the face's centre [Pa], for a local texture response
  /// `texture` = e^{h/lambda}/<e^{h/lambda}>.
  [[nodiscard]] double pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                   double texture) const;

  /// Height of the fabric's mean surface under a face at `pose`, downwards, in the z stage's scale.
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
  // Precomputed, because every step needs them.
  double per_lambda_ = 1 / material_.law.lambda_m;
  double top_n_ = geometry_.face_area_m2() * material_.law.pressure_pa;  // per unit of e^s - 1
  double per_length_ = 1 / material_.hysteresis.length;
  double turn_ = material_.hysteresis.eta / (1 + material_.hysteresis.eta);
  NearPower power_{material_.friction.exponent};  ///< for a change in load
};

/// ln(sinh(x)/x): average of e^{x t} over t in [-1, 1], safe for any finite x.
inline double log_sinhc(double x) {
  const double a = std::abs(x);
  if (!(a < 0.25)) return a + std::log(-std::expm1(-2 * a) / (2 * a));
  const double b = a * a;  // the truncation error is below 1e-16
  return b * (1.0 / 6 -
              b * (1.0 / 180 -
                   b * (1.0 / 2835 -
                        b * (1.0 / 37800 - b * (1.0 / 467775 - b * (691.0 / 3831077250.0))))));
}

}  // namespace weft::sim
