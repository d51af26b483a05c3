#include "recipes/engine/sweep_warnings.hpp"

#include <algorithm>

namespace weft::recipes {
namespace {

constexpr const char* for_analysis = "weft design analyse will have to leave it out";

std::size_t samples(double seconds, double rate_hz) {
  return static_cast<std::size_t>(seconds * rate_hz);
}

/// The cell of an exploration whose phase is shortest, told where it is too short.
void check_phase(const Plan& plan, std::size_t exploration, Phase phase, std::size_t least,
                 std::vector<Diagnostic>& out) {
  const std::size_t cells = plan.sweep->cells.size();
  const auto first = plan.explorations.begin() + static_cast<std::ptrdiff_t>(exploration * cells);
  const auto shortest =
      std::min_element(first, first + static_cast<std::ptrdiff_t>(cells),
                       [&](const Exploration& a, const Exploration& b) {
                         return a.step(phase).duration_s < b.step(phase).duration_s;
                       });
  const std::size_t got = samples(shortest->step(phase).duration_s, plan.limits.taxel_rate_hz);
  if (got < least)
    out.push_back({child("/explorations", plan.sweep->explorations[exploration]),
                   std::string("too few samples in phase ") + to_char(phase) + ": " + for_analysis,
                   "at least " + std::to_string(least) + " in every cell",
                   std::to_string(got) + " in " + shortest->name,
                   phase == Phase::motion ? "slide further or slower" : "hold it for longer"});
}

}  // namespace

std::vector<Diagnostic> warnings_about_sweep(const Plan& plan) {
  std::vector<Diagnostic> out;
  if (!plan.sweep) return out;
  if (plan.fabrics.size() < least_swept_fabrics)
    out.push_back({"/fabrics", "there is nothing to tell apart: weft design analyse will refuse it",
                   std::to_string(least_swept_fabrics) + " fabrics or more",
                   std::to_string(plan.fabrics.size()), ""});
  if (plan.sweep->replicates < least_swept_replicates)
    out.push_back({"/sweep/replicates",
                   "too few replicates to leave one out: weft design analyse will refuse it",
                   "at least " + std::to_string(least_swept_replicates),
                   std::to_string(plan.sweep->replicates),
                   "or analyse it together with another sweep of the same cells"});
  const std::size_t cells = plan.sweep->cells.size();
  for (std::size_t e = 0; e < plan.sweep->explorations.size(); ++e) {
    if (!plan.explorations[e * cells].slides()) {
      out.push_back({child("/explorations", plan.sweep->explorations[e]),
                     std::string("a press has no phase M: ") + for_analysis, "a slide", "", ""});
      continue;
    }
    check_phase(plan, e, Phase::press, least_press_samples, out);
    check_phase(plan, e, Phase::motion, least_motion_samples, out);
  }
  return out;
}

}  // namespace weft::recipes
