#pragma once
// The bare press of docs/reference/plant.md, Integrators: 4 s, approach at 1 mm/s, an exponential
// fabric with two Prony terms, a probe of 0.2 kg on a spring of 2e4 N/m that pulls and pushes; no
// slack, hysteresis or waves. The page does not state the start and stop of the stage, the damping
// and the fabric. Here the speed rises and falls within 0.2 s by half a cosine. The damping of the
// mount is chosen so that level L1, which has none, is wrong on denim by the page's 2.5e-3 of 5 N.
// SIMULATED throughout.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/plant/dynamic/dynamic_contact.hpp"

namespace weft::bench {

class SoftPress {
 public:
  static constexpr double pose_s = 1e-3;   ///< [s]; the stage moves straight between two poses
  static constexpr std::size_t scan = 27;  ///< poses between two compared forces
  static constexpr double press_n = 5, length_s = 4, mount_damping = 0.18;
  // The prototype's worst error over 5 N, and simulated seconds per processor second.
  static constexpr double notes_l1_error = 2.5e-3;
  static constexpr double notes_1ms_error = 3.9e-6, notes_1ms_speed = 7380;
  static constexpr double notes_100us_error = 3.4e-8, notes_100us_speed = 831;

  /// `material` should have no hysteresis and no waves. `rise_s` [s]: rise time of the stage's
  /// speed.
  explicit SoftPress(const sim::ContactMaterial& material, double rise_s = 0.2)
      : material_(material) {
    mount_.slack_m = 0;
    mount_.stop_stiffness_n_m = mount_.stiffness_n_m;
    const double face_n = plate_.face_area_m2() * material.law.pressure_pa;
    const double touch_m = plate_.plate_z_m - material.thickness_m;
    const double end_m = touch_m + material.law.lambda_m * std::log1p(press_n / face_n) +
                         (press_n - mount_.weight_n()) / mount_.stiffness_n_m;
    const double begin_m = touch_m - 0.5e-3 + mount_.hanging_extension_m();
    const double whole_s = (end_m - begin_m) / speed_mps + rise_s;
    for (int i = 1; i <= static_cast<int>(length_s / pose_s); ++i) {
      const double t_s = std::min(i * pose_s, whole_s);
      path_.push_back({.z_m = t_s < whole_s / 2 ? begin_m + way_m(t_s, rise_s)
                                                : end_m - way_m(whole_s - t_s, rise_s)});
    }
    start_ = quasistatic().step({}, {.z_m = begin_m}, 0);
  }

  [[nodiscard]] sim::ContactModel quasistatic() const { return {plate_, mount_, material_}; }
  [[nodiscard]] sim::DynamicContact dynamic(double step_s, sim::Integrator integrator) const {
    sim::DynamicsParams params;
    params.step_s = step_s;
    params.integrator = integrator;
    params.normal_damping = mount_damping;
    return {plate_, mount_, material_, params};
  }

  /// Normal force [N] at each scan.
  template <class Contact>
  [[nodiscard]] std::vector<double> forces_n(const Contact& contact) const {
    std::vector<double> out;
    sim::ContactState state = start_;
    for (std::size_t i = 0; i < path_.size(); ++i) {
      state = contact.step(state, path_[i], pose_s);
      if ((i + 1) % scan == 0) out.push_back(state.normal_n);
    }
    return out;
  }

  /// The largest difference, relative to 5 N.
  static double error(const std::vector<double>& forces_n, const std::vector<double>& truth_n) {
    double worst_n = 0;
    for (std::size_t i = 0; i < truth_n.size(); ++i)
      worst_n = std::max(worst_n, std::abs(forces_n[i] - truth_n[i]));
    return worst_n / press_n;
  }

 private:
  static constexpr double speed_mps = 1e-3;
  /// Way [m] of a stage that started `t_s` ago.
  static double way_m(double t_s, double rise_s) {
    if (t_s >= rise_s) return speed_mps * (t_s - rise_s / 2);
    const double pi = std::numbers::pi;
    return speed_mps * (t_s / 2 - rise_s / (2 * pi) * std::sin(pi * t_s / rise_s));
  }

  sim::ContactMaterial material_;
  sim::ContactGeometry plate_{.plate_z_m = 0.06};
  sim::Mount mount_;
  std::vector<sim::Pose> path_;
  sim::ContactState start_;
};

}  // namespace weft::bench
