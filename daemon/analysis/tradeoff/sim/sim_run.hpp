#pragma once
// One scene at one level, integrator and step.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/sim/sim_scene.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {
class DynamicContact;
class SoundingContact;
}  // namespace weft::sim

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
  std::vector<std::array<std::uint16_t, sim::pad_count>> pads;  ///< per sample; see sim_pads.hpp
};

/// Holds a case's model, so that setting up is not timed with the run.
class SimRunner {
 public:
  /// Errors: what check() of the dynamics and Vibration refuse; a step that does not divide a
  /// sample or the scene's grid.
  static Result<SimRunner> make(const SimCase& one, const SimSetting& setting);
  [[nodiscard]] SimTrace run() const;

 private:
  SimRunner(const SimCase& one, const SimSetting& setting) : case_(&one), setting_(setting) {}
  template <class Step>
  [[nodiscard]] SimTrace follow(const Step& step) const;
  [[nodiscard]] SimTrace run_algebraic() const;
  [[nodiscard]] SimTrace run_quasistatic() const;
  [[nodiscard]] SimTrace run_dynamic() const;
  [[nodiscard]] SimTrace run_modal() const;
  [[nodiscard]] sim::DynamicContact dynamic_contact() const;
  [[nodiscard]] Result<sim::SoundingContact> sounding_contact() const;

  const SimCase* case_;
  SimSetting setting_;
  std::size_t stride_ = 1;    ///< grid points per look
  std::size_t substeps_ = 1;  ///< of a look
};

/// The spring of the guide pulls the probe with this force along y, which is what a force sensor
/// sees of stick-slip; level L1 has no guide, there it is the friction.
double guide_force_n(const SimCase& one, const sim::ContactState& state, sim::Level level);

}  // namespace weft::daemon
