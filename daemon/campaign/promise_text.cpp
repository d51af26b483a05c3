#include "daemon/campaign/promise_text.hpp"

#include <cmath>

#include "sim/plant/bounds.hpp"
#include "sim/plant/fidelity/forecast.hpp"

namespace weft::daemon {
namespace {

using sim::printed;

std::string format_mn(double force_n) {
  if (!std::isfinite(force_n)) return "no finite force";
  return printed("%.3g mN", force_n * 1e3);
}

std::string format_place(const SimulationPromise& promise) {
  return " (" + promise.fabric + ", " + promise.exploration + ", phase " + promise.phase +
         printed(" at %.1f s)", promise.at_s);
}

std::string format_next(const SimulationPromise& promise) {
  if (promise.next_setting.empty()) return "; no setting of the table promises less";
  return "; next setting " + promise.next_setting + " promises " +
         format_mn(promise.next_promise_n) + ", add --accuracy-strict";
}

std::string format_missed(const SimulationPromise& promise) {
  const std::string requested = "MISSED: asked " + format_mn(promise.requested_n);
  if (!promise.is_checked) return requested + ", not checked: no trial was replayed";
  const std::string measured =
      requested + ", measured " + format_mn(promise.measured_n) + format_place(promise);
  if (promise.is_resolved) return measured + format_next(promise);
  return measured + ", which is not resolved: two references differ by " +
         format_mn(promise.uncertainty_n) + format_next(promise);
}

}  // namespace

std::string format_promise(const SimulationNote& note) {
  if (!note.promise) return {};
  const SimulationPromise& promise = *note.promise;
  if (!promise.has_run)
    return "Promised: an error of at most " + format_mn(promise.promised_n) + ", asked " +
           format_mn(promise.requested_n);
  if (!promise.held) return format_missed(promise);
  return "Accuracy kept: asked " + format_mn(promise.requested_n) + ", promised " +
         format_mn(promise.promised_n) + ", measured " + format_mn(promise.measured_n) +
         format_place(promise);
}

std::string format_budget(const SimulationNote& note) {
  if (!note.budget) return {};
  const SimulationBudget& budget = *note.budget;
  const std::string out = "asked " + sim::format_times(budget.requested) + ", forecast " +
                          sim::format_times(budget.forecast);
  return budget.achieved > 0 ? out + ", achieved " + sim::format_times(budget.achieved) : out;
}

}  // namespace weft::daemon
