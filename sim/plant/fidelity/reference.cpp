#include "sim/plant/fidelity/reference.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {
namespace {

constexpr double longest_step_s = 50e-6, longest_quick_step_s = 200e-6;
constexpr double finer_share = 0.25;

Reference tr_bdf2_of(const FidelitySetting& run, double longest_s) {
  if (run.level < Level::dynamic) return {Integrator::tr_bdf2, longest_s};
  const double step_s = run.step_s > 0 ? run.step_s : grid_step_s;
  return {Integrator::tr_bdf2, std::min(finer_share * step_s, longest_s)};
}

}  // namespace

Reference first_reference(const FidelitySetting& run, int halvings) {
  Reference out = tr_bdf2_of(run, longest_step_s);
  out.step_s = std::ldexp(out.step_s, -halvings);
  return out;
}

Reference second_reference(const Reference& first) {
  return {Integrator::midpoint, first.step_s / 2};
}

Reference quick_reference(const FidelitySetting& run) {
  return tr_bdf2_of(run, longest_quick_step_s);
}

}  // namespace weft::sim
