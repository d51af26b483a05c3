#pragma once
// Reference for the force of a run: level L2 with another integrator and a finer step. L0 and L1
// are compared with L2 too, because their error is that of the model. L3 has the force of L2.

#include "sim/plant/fidelity/setting.hpp"

namespace weft::sim {

struct Reference {
  Integrator integrator = Integrator::tr_bdf2;
  double step_s = 0;
  [[nodiscard]] FidelitySetting setting() const { return {Level::dynamic, integrator, step_s}; }
};

/// TR-BDF2 with a quarter of the run's step and at most 50 us. Both methods are of second order, so
/// its error is at most a sixteenth. `halvings`: number of further halvings of the step.
Reference first_reference(const FidelitySetting& run, int halvings = 0);
/// The implicit midpoint rule with half the step of `first`. The difference of the two references
/// is the uncertainty of both.
Reference second_reference(const Reference& first);
/// For a run without a requested accuracy: four times as coarse at levels L0 and L1.
Reference quick_reference(const FidelitySetting& run);

/// The references are accepted if they differ by at most this share of the requested accuracy.
constexpr double trusted_share = 0.2;
constexpr int most_halvings = 3;

}  // namespace weft::sim
