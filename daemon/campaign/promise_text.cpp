#include "daemon/campaign/promise_text.hpp"

#include <cmath>

#include "daemon/base/text/format.hpp"
#include "daemon/campaign/error_check.hpp"
#include "sim/plant/bounds.hpp"
#include "sim/plant/fidelity/forecast.hpp"

namespace weft::daemon {
namespace {

using sim::printed;

std::string format_mn(double force_n) {
  if (!std::isfinite(force_n)) return "no finite force";
  return significant(force_n * 1e3) + " mN";
}

std::string format_place(const SimulationPromise& promise) {
  return " (" + promise.fabric + ", " + promise.exploration + ", phase " + promise.phase +
         printed(" at %.1f s)", promise.at_s);
}

std::string format_next(const SimulationPromise& promise) {
  if (promise.next_setting.empty()) return "; no setting of the table promises a smaller error";
  return "; next setting " + promise.next_setting + " promises " +
         format_mn(promise.next_promise_n) + ", add --accuracy-strict";
}

std::string format_pairs(const SimulationPromise& promise) {
  return std::to_string(promise.checked_pairs) + " of " + std::to_string(promise.pairs) +
         " pairs of fabric and exploration";
}

std::string format_missed(const SimulationPromise& promise) {
  const std::string requested = "MISSED: requested " + format_mn(promise.requested_n);
  const std::string found = ", measured " + format_mn(promise.measured_n) + format_place(promise);
  if (is_measured_miss(promise)) return requested + found + format_next(promise);
  if (promise.checked_pairs < promise.pairs || !promise.is_checked)
    return requested + ", not checked: " + format_pairs(promise) +
           (promise.is_checked ? found : std::string());
  const std::string measured = requested + found;
  return measured + ", not resolved, because two references differ by " +
         format_mn(promise.uncertainty_n) + format_next(promise);
}

}  // namespace

std::string format_promise(const SimulationNote& note) {
  if (!note.promise) return {};
  const SimulationPromise& promise = *note.promise;
  if (!promise.has_run)
    return "Promised: an error of at most " + format_mn(promise.promised_n) + ", requested " +
           format_mn(promise.requested_n) +
           (promise.pairs > ErrorCheck::most_trials
                ? "; the run checks only " + std::to_string(ErrorCheck::most_trials) + " of " +
                      std::to_string(promise.pairs) + " pairs and cannot confirm the promise"
                : std::string());
  if (!promise.held) return format_missed(promise);
  return "Accuracy kept: requested " + format_mn(promise.requested_n) + ", promised " +
         format_mn(promise.promised_n) + ", measured " + format_mn(promise.measured_n) +
         format_place(promise);
}

std::string format_budget(const SimulationNote& note) {
  if (!note.budget) return {};
  const SimulationBudget& budget = *note.budget;
  const std::string out = "requested " + sim::format_times(budget.requested) + ", forecast " +
                          sim::format_times(budget.forecast);
  if (!(budget.achieved > 0)) return out;
  return out + ", achieved " + sim::format_times(budget.achieved) +
         (budget.is_missed() ? ": missed" : "");
}

std::string format_whole_run(const SimulationNote& note, double bench_s, double wall_s) {
  if (!note.budget || !(wall_s > 0)) return {};
  SimulationNote whole;
  whole.budget = SimulationBudget{.requested = note.budget->requested,
                                  .forecast = note.budget->whole_run_forecast,
                                  .achieved = bench_s / wall_s};
  return "whole run, with export and evaluation: " + format_budget(whole);
}

std::string format_aside(const SimulationNote& note) {
  std::string out;
  for (const std::string& folder : note.aside)
    out += (out.empty() ? "attempts that missed the accuracy: " : ", ") + folder;
  return out;
}

}  // namespace weft::daemon
