#pragma once
// A press on a fabric, just large enough to test the force loop: exponential compression with two
// Prony terms (docs/reference/plant.md, Contact law), in series with a mount that has slack, moved
// by a stage with limited acceleration, lag and a reported position of one micrometre. Independent
// of sim/.

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <random>

namespace weft::recipes::test {

struct Cloth {
  const char* name;
  double lambda_m;
  double pressure_pa;  ///< p_s
};

/// docs/reference/plant.md, Fabrics: lambda and p_s.
inline constexpr std::array<Cloth, 17> cloths{{{"knitwear1", 92.9e-6, 30},
                                               {"wool", 34.5e-6, 13},
                                               {"pile", 495e-6, 30},
                                               {"velvet", 113e-6, 22},
                                               {"flax", 24.4e-6, 13},
                                               {"denim", 60.4e-6, 5},
                                               {"cotton", 24.4e-6, 15},
                                               {"silk", 9.2e-6, 22},
                                               {"fleece", 337e-6, 54},
                                               {"felt", 171e-6, 79},
                                               {"corduroy", 103e-6, 22},
                                               {"polyester", 8.3e-6, 41},
                                               {"nylon", 4.3e-6, 79},
                                               {"satin", 10.2e-6, 18},
                                               {"jersey", 50.9e-6, 15},
                                               {"viscose", 16.3e-6, 15},
                                               {"terry", 312e-6, 41}}};

class PressModel {
 public:
  struct Setup {
    Cloth cloth;
    int delay_cycles = 1;
    double cycle_s = 0.01;
    double mount_npm = 2e4;
    double slack_left_m = 0.2e-3;  ///< z moves this far before the mount's spring pushes
    double force_quantum_n = 0.02;
    double force_noise_n = 0.01;  ///< standard deviation
    int readings = 1;             ///< per cycle, of which measured_n() is the mean
    double quantum_m = 0;         ///< the carriage moves in multiples of this; 0: continuous
  };

  explicit PressModel(const Setup& setup) : setup_(setup) { settle(); }

  /// One cycle with this commanded velocity of the stage.
  void advance(double command_mps) {
    for (int i = 0; i < substeps; ++i) move_stage(command_mps, setup_.cycle_s / substeps);
    force_n_ = solve();
    readings_.push_front(read());
    if (readings_.size() > 8) readings_.pop_back();
  }

  /// The texture lifts the probe by this much [m].
  void set_height(double height_m) { height_m_ = height_m; }

  [[nodiscard]] double force_n() const { return force_n_; }
  [[nodiscard]] double measured_n() const { return delayed().force_n; }
  [[nodiscard]] double reported_z_m() const { return delayed().z_m; }

 private:
  struct Reading {
    double force_n;
    double z_m;
  };
  static constexpr int substeps = 10;
  static constexpr double weight_n = 0.2 * 9.80665;
  static constexpr double area_m2 = 2.56e-4;
  static constexpr double stage_lag_s = 0.005;
  static constexpr double stage_mps2 = 20e-3;
  static constexpr std::array<double, 2> share{0.2, 0.17};  ///< at RC 50 %
  static constexpr std::array<double, 2> time_s{0.3, 5};

  void move_stage(double command_mps, double dt_s) {
    const double wanted = (command_mps - velocity_mps_) * std::min(1.0, dt_s / stage_lag_s);
    velocity_mps_ += std::clamp(wanted, -stage_mps2 * dt_s, stage_mps2 * dt_s);
    z_m_ += velocity_mps_ * dt_s;
  }

  [[nodiscard]] double elastic_n(double depth_m) const {
    const double x = std::min(depth_m / setup_.cloth.lambda_m, 700.0);
    return depth_m > 0 ? area_m2 * setup_.cloth.pressure_pa * std::expm1(x) : 0;
  }

  /// Force of the fabric after one cycle at this depth.
  [[nodiscard]] double cloth_n(double depth_m) const {
    double force = elastic_n(depth_m);
    for (std::size_t i = 0; i < share.size(); ++i) {
      const double saved = std::exp(-setup_.cycle_s / time_s[i]);
      force -= relaxed_n_[i] * saved + share[i] * elastic_n(depth_m) * (1 - saved);
    }
    return force;
  }

  [[nodiscard]] double mount_n(double depth_m) const {
    const double q = setup_.quantum_m;
    const double carriage_m = q > 0 ? q * std::round(z_m_ / q) : z_m_;
    return weight_n + setup_.mount_npm * std::max(0.0, carriage_m + height_m_ - depth_m - rest_m_);
  }

  /// Depth at which fabric and mount balance, by bisection; then the relaxation advances.
  double solve() {
    double low = 0;
    double high = 0.02;
    for (int i = 0; i < 60; ++i) {
      const double mid = (low + high) / 2;
      (cloth_n(mid) < mount_n(mid) ? low : high) = mid;
    }
    const double force = cloth_n(high);
    for (std::size_t i = 0; i < share.size(); ++i) {
      const double saved = std::exp(-setup_.cycle_s / time_s[i]);
      relaxed_n_[i] = relaxed_n_[i] * saved + share[i] * elastic_n(high) * (1 - saved);
    }
    depth_m_ = high;
    return force;
  }

  /// Phase S: three seconds under the probe's weight.
  void settle() {
    rest_m_ = 1;  // the mount stays slack
    for (int i = 0; i < 300; ++i) force_n_ = solve();
    rest_m_ = setup_.slack_left_m - depth_m_;
    readings_.assign(8, read());
  }

  Reading read() {
    std::normal_distribution<double> noise(0, setup_.force_noise_n);
    const double q = setup_.force_quantum_n;
    double sum_n = 0;
    for (int i = 0; i < setup_.readings; ++i)
      sum_n += q * std::round((force_n_ + noise(random_)) / q);
    return {sum_n / setup_.readings, 1e-6 * std::round(z_m_ / 1e-6)};
  }

  [[nodiscard]] const Reading& delayed() const {
    return readings_[static_cast<std::size_t>(setup_.delay_cycles)];
  }

  Setup setup_;
  double z_m_ = 0, velocity_mps_ = 0, height_m_ = 0;
  double rest_m_ = 0;  ///< stage minus probe when the slack is used up
  double depth_m_ = 0, force_n_ = 0;
  std::array<double, 2> relaxed_n_{};
  std::deque<Reading> readings_;  ///< newest first
  std::mt19937 random_{1};
};

}  // namespace weft::recipes::test
