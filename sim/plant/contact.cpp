#include "sim/plant/contact.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {

namespace {

constexpr double largest_exponent = 700;  // e^700 is still finite
constexpr int newton_limit = 80;          // quadratic from a bracket: 3 to 8 in use
constexpr double newton_tolerance = 1e-9;
constexpr double largest_pressure_pa = 1e12;

}  // namespace

double log_sinhc(double x) {
  const double a = std::abs(x);
  if (a < 1e-3) return a * a / 6;  // error a^4/180 < 1e-14
  return a + std::log(-std::expm1(-2 * a) / (2 * a));
}

/// weight + mount force - cloth force as a function of the exponent s. Falls monotonically.
struct ContactModel::Balance {
  const ContactModel& model;
  const RelaxationStep& relaxation;
  double offset_n;  // what the memory takes off the force
  double s_from;    // where the step began
  double branch_from;
  double top_n;        // law's force per unit of e^s - 1
  double extension_0;  // mount extension at s = 0

  struct Value {
    double residual_n, slope_n, elastic_n, force_n, branch;
  };

  [[nodiscard]] Value at(double s) const {
    const Hysteresis& hysteresis = model.material_.hysteresis;
    const double growth = std::exp(std::min(s, largest_exponent));
    Value value{0, 0, top_n * (growth - 1), 0, branch_from};
    double slope = top_n * growth;
    if (hysteresis.eta > 0) {
      value.branch = branch_after(branch_from, s_from, s, hysteresis);
      const double factor = branch_factor(value.branch, hysteresis.eta);
      const double turning = (s > s_from ? 1 - value.branch : 1 + value.branch) / hysteresis.length;
      slope = slope * factor + value.elastic_n * hysteresis.eta / (1 + hysteresis.eta) * turning;
      value.elastic_n *= factor;
    }
    value.force_n = relaxation.gain * value.elastic_n - offset_n;
    const double lambda_m = model.material_.law.lambda_m;
    const double extension = extension_0 - lambda_m * s;
    value.slope_n = -lambda_m * model.mount_.slope_n_m(extension);
    if (value.force_n > 0)
      value.slope_n -= relaxation.gain * slope;
    else
      value.force_n = 0;
    value.residual_n = model.mount_.weight_n() + model.mount_.force_n(extension) - value.force_n;
    return value;
  }

  /// No load that the mount can bring leads beyond this.
  [[nodiscard]] double highest() const {
    const double load = model.mount_.weight_n() + model.mount_.force_n(extension_0);
    const double weakest = branch_factor(-1, model.material_.hysteresis.eta);
    return std::log1p((load + offset_n) / (relaxation.gain * weakest * top_n));
  }

  /// Newton inside a bracket that every value tightens; halves it where Newton leaves it.
  [[nodiscard]] double root() const {
    double low = 0, high = highest();
    double s = std::clamp(s_from, low, high);
    for (int i = 0; i < newton_limit; ++i) {
      const Value value = at(s);
      (value.residual_n > 0 ? low : high) = s;
      double next = s - value.residual_n / value.slope_n;
      if (!(next >= low && next <= high)) next = 0.5 * (low + high);
      const double moved = std::abs(next - s);
      s = next;
      if (moved < newton_tolerance) break;
    }
    return s;
  }
};

double ContactModel::surface_z_m(const Pose& pose) const {
  return geometry_.plate_z_m - material_.thickness_m -
         pose.rx_rad * (pose.y_m - geometry_.tilt_axis_y_m);
}

/// ln of the average of e^{(waviness + slope r)/lambda} over the face.
double ContactModel::log_average(const ContactState& state) const {
  const double lambda_m = material_.law.lambda_m;
  const double half = geometry_.face_half_width_m / lambda_m;
  return material_.waviness.height_m(state.pose.x_m, state.pose.y_m) / lambda_m +
         log_sinhc(state.slope_x * half) + log_sinhc(state.slope_y * half);
}

ContactState ContactModel::step(const ContactState& from, const Pose& pose, double dt_s) const {
  ContactState state = from;
  state.pose = pose;
  state.slope_x = geometry_.tilt_x - pose.ry_rad;
  state.slope_y = geometry_.tilt_y + pose.rx_rad;
  const double average = log_average(state);
  const RelaxationStep relaxation(material_.relaxation, dt_s);
  const double at_touch =
      pose.z_m - (surface_z_m(pose) - material_.law.lambda_m * average);  // extension at s = 0
  if (mount_.weight_n() + mount_.force_n(at_touch) > 0)
    press(state, relaxation, average);
  else
    hang(state, relaxation, average);
  slide(state, from.pose);
  return state;
}

void ContactModel::press(ContactState& state, const RelaxationStep& relaxation,
                         double log_average) const {
  const double lambda_m = material_.law.lambda_m;
  const double touch_z_m = surface_z_m(state.pose) - lambda_m * log_average;
  const double top_n = geometry_.face_area_m2() * material_.law.pressure_pa;
  const Balance balance{*this,
                        relaxation,
                        relaxation.offset_n(state.relaxation),
                        state.exponent,
                        state.branch,
                        top_n,
                        state.pose.z_m - touch_z_m};
  state.exponent = balance.root();
  const auto value = balance.at(state.exponent);
  state.branch = value.branch;
  state.normal_n = value.force_n;
  state.load_ratio = value.force_n / (top_n * std::expm1(std::max(state.exponent, 1e-12)));
  state.extension_m = balance.extension_0 - lambda_m * state.exponent;
  state.indentation_m = state.probe_z_m() - surface_z_m(state.pose);
  relaxation.advance(state.relaxation, value.elastic_n);
}

void ContactModel::hang(ContactState& state, const RelaxationStep& relaxation,
                        double log_average) const {
  state.extension_m = mount_.hanging_extension_m();
  state.indentation_m = state.probe_z_m() - surface_z_m(state.pose);
  state.exponent = state.indentation_m / material_.law.lambda_m + log_average;
  state.branch = -1;
  state.normal_n = 0;
  state.load_ratio = 0;
  relaxation.advance(state.relaxation, 0);
}

void ContactModel::slide(ContactState& state, const Pose& from) const {
  const Friction& friction = material_.friction;
  if (!(state.normal_n > 0) || !(friction.coefficient > 0)) {
    state.bristle = state.friction_n = {};
    return;
  }
  const Vector2 moved{state.pose.x_m - from.x_m, state.pose.y_m - from.y_m};
  state.bristle = bristle_after(state.bristle, moved, friction.bristle_length_m);
  const double limit_n = friction.sliding_n(state.normal_n);
  state.friction_n = {limit_n * state.bristle[0], limit_n * state.bristle[1]};
}

double ContactModel::pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                 double texture) const {
  if (!(state.normal_n > 0)) return 0;
  const double height_m =
      material_.waviness.height_m(state.face_x_m() + dx_m, state.face_y_m() + dy_m);
  const double local_m =
      state.indentation_m + state.slope_x * dx_m + state.slope_y * dy_m + height_m;
  const double growth = std::exp(std::min(local_m / material_.law.lambda_m, largest_exponent));
  const double pressure = state.load_ratio * material_.law.pressure_pa * (growth * texture - 1);
  return std::clamp(pressure, 0.0, largest_pressure_pa);
}

}  // namespace weft::sim
