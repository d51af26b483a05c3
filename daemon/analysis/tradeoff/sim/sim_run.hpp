#pragma once
// One scene at one level, integrator and step. While it runs, touch-downs and the extremes and
// slips of a stick-slip cycle are looked for, between looks by a cubic through values and slopes.

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
  double step_s = sim_sample_s;  ///< a sample, or a whole share of one; L0 knows no other

  [[nodiscard]] std::string name() const;  ///< "L2 midpoint 0.384 ms"
  /// To a nanosecond; 0 at L0, which has no step.
  [[nodiscard]] double step_us() const;
  [[nodiscard]] std::string family() const;  ///< "L2 midpoint"
};

/// "midpoint", "adaptive", "tr_bdf2"; "none" below L2.
std::string format_integrator(const SimSetting& setting);

/// A limit cycle of friction, of the spring of the guide.
struct SimCycle {
  double peak_to_peak_n = 0;
  double frequency_hz = 0;  ///< 0: fewer than three slips
};

/// What a run saw.
struct SimTrace {
  std::vector<sim::ContactState> samples;  ///< one per sample, the first after one of them
  std::vector<double> touch_s;             ///< touch-downs, between the looks by their trend
  SimCycle cycle;
  std::vector<std::array<std::uint16_t, sim::pad_count>> pads;  ///< per sample; see measure_sim.cpp
};

/// A case with its setting, checked, so that setting up is not timed with the run. run() takes only
/// one that make() gave.
struct SimRunner {
  const SimCase* one;
  SimSetting setting;
  std::size_t stride = 1;    ///< grid points per look
  std::size_t substeps = 1;  ///< of a look

  /// Errors: what check() of the dynamics and Vibration refuse; a step that does not divide a
  /// sample or the scene's grid.
  static Result<SimRunner> make(const SimCase& one, const SimSetting& setting);
  [[nodiscard]] SimTrace run() const;
};

/// A quantity and its rate at one look.
struct ForceSample {
  double t_s = 0;
  double value = 0;
  double rate = 0;
};

/// Time at which the cubic through two looks crosses zero; they lie on both sides of it.
double crossing_s(const ForceSample& a, const ForceSample& b);

/// Largest or least value of the cubic where its rate changes sign between two looks.
double extreme_between(const ForceSample& a, const ForceSample& b);

class TouchWatch {
 public:
  /// `gap_m` > 0 is above the cloth; `gap_mps` its rate.
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
