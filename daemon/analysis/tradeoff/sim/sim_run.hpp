#pragma once
// One scene at one level, integrator and step. The run detects touch-downs and the extremes and
// slips of a stick-slip cycle. Between two observations it uses a cubic through values and slopes.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/sim/sim_scene.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::daemon {

/// How a scene is computed.
struct SimSetting {
  sim::Level level = sim::Level::quasistatic;              ///< L0 to L3
  sim::Integrator integrator = sim::Integrator::midpoint;  ///< from L2 on
  double step_s = sim_sample_s;  ///< one sample, or an integer fraction of it; L0 allows only one
                                 ///< sample

  [[nodiscard]] std::string name() const;  ///< "L2 midpoint 0.384 ms"
  /// Rounded to 1 ns; 0 at L0, which has no step.
  [[nodiscard]] double step_us() const;
  [[nodiscard]] std::string family() const;  ///< "L2 midpoint"
};

/// "midpoint", "adaptive", "tr_bdf2"; "none" below L2.
std::string format_integrator(const SimSetting& setting);

/// A limit cycle of friction, observed in the force of the guide's spring.
struct SimCycle {
  double peak_to_peak_n = 0;
  double frequency_hz = 0;  ///< 0: fewer than three slips
};

/// Recorded results of a run.
struct SimTrace {
  std::vector<sim::ContactState> samples;  ///< one per sample; the first is after one sample
  std::vector<double> touch_s;             ///< touch-downs, interpolated between observations
  SimCycle cycle;
  std::vector<std::array<std::uint16_t, sim::pad_count>> pads;  ///< counts per sample; see
                                                                ///< measure_sim.cpp
};

/// A case with its setting, checked, so that setup is not part of the timed run. Call run() only on
/// an object from make().
struct SimRunner {
  const SimCase* one;
  SimSetting setting;
  std::size_t stride = 1;    ///< grid points per observation
  std::size_t substeps = 1;  ///< per observation

  /// Errors: those of the checks of dynamics and Vibration; a step that does not divide a sample or
  /// the scene's grid.
  static Result<SimRunner> make(const SimCase& one, const SimSetting& setting);
  [[nodiscard]] SimTrace run() const;
};

/// A quantity and its rate at one observation.
struct ForceSample {
  double t_s = 0;
  double value = 0;
  double rate = 0;
};

/// Time at which the cubic through two observations crosses zero; the observations must have
/// opposite signs.
double crossing_s(const ForceSample& a, const ForceSample& b);

/// Extreme value of the cubic if its rate changes sign between two observations.
double extreme_between(const ForceSample& a, const ForceSample& b);

class TouchWatch {
 public:
  /// `gap_m` > 0 means above the fabric; `gap_mps`: its rate.
  void see(const ForceSample& gap);
  [[nodiscard]] std::vector<double> times_s() && { return std::move(times_s_); }

 private:
  ForceSample last_{-1, -1, 0};
  std::vector<double> times_s_;
};

class CycleWatch {
 public:
  /// Force of the spring and its rate.
  void see(const ForceSample& force);
  [[nodiscard]] double peak_to_peak() const { return high_ > low_ ? high_ - low_ : 0; }
  /// 0 with fewer than three slips.
  [[nodiscard]] double frequency_hz() const;

 private:
  ForceSample last_{-1, 0, 0};
  double low_ = 1e300, high_ = -1e300, first_s_ = 0, last_s_ = 0;
  int slips_ = 0;
};

}  // namespace weft::daemon
