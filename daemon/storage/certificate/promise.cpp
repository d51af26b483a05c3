#include "daemon/storage/certificate/promise.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace weft::daemon {

using nlohmann::json;

namespace {

/// JSON has no infinity; it is written as null.
double force_at(const json& object, const char* key) {
  const json& found = object.at(key);
  return found.is_null() ? HUGE_VAL : found.get<double>();
}

}  // namespace

void to_json(json& out, const SimulationPromise& promise) {
  out = {{"asked_n", promise.requested_n},
         {"promised_n", promise.promised_n},
         {"is_checked", promise.is_checked},
         {"checked_pairs", promise.checked_pairs},
         {"pairs", promise.pairs},
         {"measured_n", promise.measured_n},
         {"uncertainty_n", promise.uncertainty_n},
         {"is_resolved", promise.is_resolved},
         {"held", promise.held},
         {"fabric", promise.fabric},
         {"exploration", promise.exploration},
         {"phase", promise.phase},
         {"at_s", promise.at_s}};
  if (promise.next_setting.empty()) return;
  out["next"] = {{"setting", promise.next_setting}, {"promise_n", promise.next_promise_n}};
}

void from_json(const json& object, SimulationPromise& promise) {
  promise.has_run = true;
  object.at("asked_n").get_to(promise.requested_n);
  object.at("promised_n").get_to(promise.promised_n);
  object.at("is_checked").get_to(promise.is_checked);
  promise.checked_pairs = object.value("checked_pairs", std::size_t{0});  // absent in early files
  promise.pairs = object.value("pairs", std::size_t{0});
  promise.measured_n = force_at(object, "measured_n");
  promise.uncertainty_n = force_at(object, "uncertainty_n");
  object.at("is_resolved").get_to(promise.is_resolved);
  object.at("held").get_to(promise.held);
  object.at("fabric").get_to(promise.fabric);
  object.at("exploration").get_to(promise.exploration);
  object.at("phase").get_to(promise.phase);
  object.at("at_s").get_to(promise.at_s);
  if (!object.contains("next")) return;
  object.at("next").at("setting").get_to(promise.next_setting);
  object.at("next").at("promise_n").get_to(promise.next_promise_n);
}

void to_json(json& out, const SimulationBudget& budget) {
  out = {{"asked", budget.requested}, {"forecast", budget.forecast}, {"achieved", budget.achieved}};
  if (budget.achieved > 0) out["held"] = !budget.is_missed();
  if (budget.whole_run_forecast > 0) out["whole_run_forecast"] = budget.whole_run_forecast;
}

void from_json(const json& object, SimulationBudget& budget) {
  object.at("asked").get_to(budget.requested);
  object.at("forecast").get_to(budget.forecast);
  object.at("achieved").get_to(budget.achieved);
  budget.whole_run_forecast = object.value("whole_run_forecast", 0.0);
}

void to_json(json& out, const CertifiedSimulation& simulation) {
  out = {{"setting", simulation.setting}};
  if (simulation.promise) out["promise"] = *simulation.promise;
  if (simulation.budget) out["budget"] = *simulation.budget;
}

void from_json(const json& object, CertifiedSimulation& simulation) {
  object.at("setting").get_to(simulation.setting);
  if (object.contains("promise"))
    simulation.promise = object.at("promise").get<SimulationPromise>();
  if (object.contains("budget")) simulation.budget = object.at("budget").get<SimulationBudget>();
}

}  // namespace weft::daemon
