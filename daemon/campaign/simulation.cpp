#include "daemon/campaign/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/error_check.hpp"
#include "recipes/engine/engine.hpp"
#include "sim/plant/bounds.hpp"
#include "sim/rig/rig_config.hpp"
#include "sim/rig/simulation_choice.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

std::vector<double> set_points_n(const recipes::Plan& plan) {
  std::vector<double> out;
  for (const recipes::Exploration& exploration : plan.explorations)
    for (const recipes::PhaseStep& step : exploration.phases)
      if (step.force_n > 0) out.push_back(step.force_n);
  return out;
}

void extend(sim::MeasuredRange& range, double value) {
  range.least = range.most > 0 ? std::min(range.least, value) : value;
  range.most = std::max(range.most, value);
}

sim::MeasuredRange slide_speeds_mps(const recipes::Plan& plan) {
  sim::MeasuredRange out;
  for (const recipes::Exploration& exploration : plan.explorations)
    if (exploration.slides()) extend(out, exploration.step(Phase::motion).speed_mps);
  return out;
}

sim::MeasuredRange press_lengths_s(const recipes::Plan& plan) {
  sim::MeasuredRange out;
  for (const recipes::Exploration& exploration : plan.explorations)
    for (const recipes::PhaseStep& step : exploration.phases)
      if (step.phase == Phase::press) extend(out, step.duration_s);
  return out;
}

sim::RunSize run_size(const recipes::Plan& plan, const FidelityRequest& requested) {
  const std::size_t fabrics = plan.fabrics.size(), explorations = plan.explorations.size();
  const bool fully = requested.accuracy_n.has_value();
  const std::size_t checked = std::min({fully ? count_pairs(plan) : fabrics + explorations - 1,
                                        plan.trials.size(), ErrorCheck::most_trials});
  const double trial_s =
      plan.forecast.trials_s() / static_cast<double>(std::max<std::size_t>(1, plan.trials.size()));
  return {.bench_s = plan.forecast.duration_s,
          .trials = plan.trials.size(),
          .checked_s = requested.is_checked ? trial_s * static_cast<double>(checked) : 0,
          .is_fully_checked = fully,
          .is_evaluated = requested.is_evaluated};
}

/// Measured once per process, so that a check and the run choose the same.
double probe_us() {
  static const double measured_us =
      sim::measure_probe_us([] { return 1e6 * thread_cpu_seconds(); });
  return measured_us;
}

/// A regulated force needs the loop's traces in the data, unless the request states otherwise.
sim::SimulationRequest simulation_request(const recipes::Plan& plan,
                                          const FidelityRequest& requested) {
  sim::SimulationRequest request{.traits = {}, .set_points_n = set_points_n(plan)};
  if (!request.set_points_n.empty()) request.traits.push_back(sim::Trait::regulated_force);
  request.fidelity.accuracy_n = requested.accuracy_n;
  request.fidelity.times_real_time = requested.times_real_time;
  request.fidelity.promise_below_n = requested.promise_below_n;
  request.fidelity.run = run_size(plan, requested);
  request.fabrics = plan.fabrics;
  request.speed_mps = slide_speeds_mps(plan);
  request.press_s = press_lengths_s(plan);
  request.seat_speed_mps = plan.approach.seat_speed_mps;
  return request;
}

Result<sim::FidelityTable> read_table(const RigFile& rig, const std::filesystem::path& rig_path) {
  constexpr const char* place = "/simulation/fidelity";
  const json root = json::parse(rig.text, nullptr, false);
  const json::json_pointer pointer(place);
  if (root.is_discarded() || !root.contains(pointer) || !root[pointer].is_string())
    return fail({.code = Errc::invalid_argument,
                 .where = place,
                 .what = "rig file without fidelity table",
                 .expected = "a path relative to the rig file",
                 .hint = "Omit --accuracy and --budget, or name sim/fidelity.json"});
  const auto text = read_text_file(rig_path.parent_path() / root[pointer].get<std::string>());
  if (!text)
    return fail({.code = text.error().code,
                 .where = place,
                 .what = "fidelity table not readable",
                 .expected = "a table made by weft trade sim",
                 .got = text.error().where});
  auto table = sim::parse_fidelity(*text);
  if (!table)
    return fail({.code = table.error().code,
                 .where = place,
                 .what = table.error().what + " in the fidelity table",
                 .expected = table.error().expected,
                 .got = table.error().got + " at " + table.error().where,
                 .hint = table.error().hint});
  if (table->rules != recipes::engine_rules)
    return fail({.code = Errc::unsupported,
                 .where = place,
                 .what = "fidelity table measured by a Weft version with other trial rules",
                 .expected = "rules " + std::to_string(recipes::engine_rules),
                 .got = "rules " + std::to_string(table->rules),
                 .hint = "Create a new table with `weft trade sim --table FILE`"});
  return table;
}

struct ErrorFigure {
  const char* key;
  double sim::RunError::*value;
};
constexpr ErrorFigure error_figures[]{
    {"force_max_n", &sim::RunError::force_max_n},
    {"force_rms_n", &sim::RunError::force_rms_n},
    {"friction_max_n", &sim::RunError::friction_max_n},
    {"friction_rms_n", &sim::RunError::friction_rms_n},
    {"taxels_max_counts", &sim::RunError::counts_max},
    {"taxels_rms_counts", &sim::RunError::counts_rms},
    {"force_max_n_with_transients", &sim::RunError::anywhere_max_n},
    {"same_motion_force_max_n", &sim::RunError::unled_max_n},
    {"same_motion_force_rms_n", &sim::RunError::unled_rms_n}};

json error_json(const SimulationError& error) {
  const sim::RunError& e = error.worst;
  json out{{"setting", e.setting}, {"reference", e.reference},           {"trials", error.trials},
           {"samples", e.samples}, {"worst_fabric", error.worst_fabric}, {"pads", e.pads}};
  for (const auto& [key, value] : error_figures) out[key] = e.*value;
  out["worst_exploration"] = error.worst_exploration;
  out["worst_phase"] = error.worst_phase;
  out["worst_at_s"] = error.worst_at_s;
  if (!e.is_doubled) return out;
  out["uncertainty_n"] = e.uncertainty_n;
  out["is_resolved"] = e.is_resolved;
  out["checked"] = error.pairs;
  const ForceError& known = error.resolved;
  out["resolved"] = {{"force_max_n", known.force_n},
                     {"fabric", known.fabric},
                     {"exploration", known.exploration},
                     {"phase", known.phase},
                     {"at_s", known.at_s}};
  return out;
}

/// JSON has no infinity: it was written as null.
double figure_at(const json& object, const char* key) {
  const json& found = object.at(key);
  return found.is_null() ? HUGE_VAL : found.get<double>();
}

ForceError force_error_from(const json& each) {
  return {.force_n = figure_at(each, "force_max_n"),
          .fabric = each.at("fabric").get<std::string>(),
          .exploration = each.at("exploration").get<std::string>(),
          .phase = each.at("phase").get<std::string>(),
          .at_s = each.at("at_s").get<double>()};
}

SimulationError error_from(const json& each) {
  SimulationError out;
  out.worst.setting = each.at("setting").get<std::string>();
  out.worst.reference = each.at("reference").get<std::string>();
  out.trials = each.at("trials").get<std::size_t>();
  out.worst.samples = each.at("samples").get<std::size_t>();
  out.worst_fabric = each.at("worst_fabric").get<std::string>();
  out.worst_exploration = each.value("worst_exploration", std::string());
  out.worst_phase = each.value("worst_phase", std::string());
  out.worst_at_s = each.value("worst_at_s", 0.0);
  out.worst.pads = each.value("pads", true);
  for (const auto& [key, value] : error_figures) out.worst.*value = figure_at(each, key);
  out.worst.is_doubled = each.contains("uncertainty_n");
  if (out.worst.is_doubled) out.worst.uncertainty_n = figure_at(each, "uncertainty_n");
  out.worst.is_resolved = each.value("is_resolved", true);
  if (each.contains("checked")) each.at("checked").get_to(out.pairs);
  if (each.contains("resolved"))
    out.resolved = force_error_from(each.at("resolved"));
  else if (out.worst.is_resolved)  // an early file
    out.resolved = out.largest();
  return out;
}

/// True if the plant is in this process: the plant of an emulated bench is in weft-rig.
bool simulated_here(const RigFile& rig) {
  const json root = json::parse(rig.text, nullptr, false);
  return root.is_object() && root.value("bench", json()) == "simulated";
}

}  // namespace

namespace {

/// Fidelity and fabric tables for a choice, read only if an accuracy or speed is requested.
struct ChoiceFiles {
  std::optional<sim::FidelityTable> table;
  std::optional<sim::FabricLibrary> library;
  bool has_rows = true;  ///< the fidelity table was measured with this fabric table
};

Result<ChoiceFiles> read_choice_files(const RigFile& rig, const std::filesystem::path& rig_path) {
  ChoiceFiles out;
  auto table = read_table(rig, rig_path);
  if (!table) return pass(table.error());
  out.table = std::move(*table);
  const auto fabrics = read_fabrics(rig, rig_path);
  if (!fabrics) return pass(fabrics.error());
  auto library = sim::parse_fabrics(*fabrics);
  if (!library) return pass(library.error(), "/simulation/fabrics");
  out.library = std::move(*library);
  out.has_rows = out.table->fabrics_sha256 == sha256_hex(*fabrics);
  return out;
}

/// A resumed campaign may repeat the original request or omit it.
Status same_request(const char* option, const std::optional<double>& now,
                    const std::optional<double>& recorded, const char* format) {
  if (!now || now == recorded) return {};
  return fail({.code = Errc::wrong_state,
               .where = option,
               .what = "campaign was started with another simulation request",
               .expected = recorded ? sim::printed(format, *recorded) : "no request",
               .got = sim::printed(format, *now),
               .hint = "Omit the option to keep the recorded request, or start a new campaign"});
}

Status same_request(const FidelityRequest& now, const SimulationNote& recorded) {
  std::optional<double> accuracy_n, times;
  if (recorded.promise) accuracy_n = recorded.promise->requested_n;
  if (recorded.budget) times = recorded.budget->requested;
  Status same = same_request("--accuracy", now.accuracy_n, accuracy_n, "%.6g N");
  return same ? same_request("--budget", now.times_real_time, times, "%.6gx") : same;
}

/// The recorded rig file, if the present one is still the one it was made from.
Result<ChosenSimulation> resumed_choice(const RigFile& rig, const RecordedSimulation& recorded,
                                        sim::SimulationRequest request) {
  const auto config = sim::parse_rig_config(recorded.rig_json);
  if (!config) return pass(config.error());
  request.recorded = sim::setting_of(config->bench_plant.plant);
  request.recorded_because = config->chosen_because;
  auto chosen = sim::choose_simulation(rig.text, request, nullptr);
  if (!chosen) return pass(chosen.error());
  return ChosenSimulation{recorded.note, std::move(chosen->rig_json)};
}

SimulationNote make_note(const sim::SimulationChoice& choice, const recipes::Plan& plan,
                         const FidelityRequest& requested) {
  SimulationNote out{
      to_string(choice.setting), std::string(to_string(choice.setting.level)), choice.because, {}};
  if (!choice.offer) return out;
  if (requested.accuracy_n) {
    out.promise = SimulationPromise{.requested_n = *requested.accuracy_n,
                                    .promised_n = choice.offer->promise_n,
                                    .pairs = count_pairs(plan)};
    if (choice.next) {
      out.promise->next_setting = to_string(choice.next->setting);
      out.promise->next_promise_n = choice.next->promise_n;
    }
  }
  if (requested.times_real_time)
    out.budget = SimulationBudget{.requested = *requested.times_real_time,
                                  .forecast = choice.offer->forecast.campaign_times_real_time(),
                                  .whole_run_forecast = choice.offer->forecast.times_real_time()};
  return out;
}

}  // namespace

Result<ChosenSimulation> choose_simulation(const RigFile& rig,
                                           const std::filesystem::path& rig_path,
                                           const recipes::Plan& plan,
                                           const FidelityRequest& requested,
                                           const std::optional<RecordedSimulation>& recorded) {
  const bool knob = requested.uses_table();
  if (!simulated_here(rig)) {
    if (!knob) return ChosenSimulation{{}, rig.text};
    return fail({.code = Errc::unsupported,
                 .where = "/bench",
                 .what = "fidelity can be chosen for a simulation only",
                 .expected = "a simulated bench",
                 .hint = "Omit --accuracy and --budget"});
  }
  sim::SimulationRequest request = simulation_request(plan, requested);
  if (recorded) {
    if (Status same = same_request(requested, recorded->note); !same) return pass(same.error());
    if (recorded->note.has_request()) return resumed_choice(rig, *recorded, std::move(request));
  }
  ChoiceFiles files;
  if (knob) {
    auto read = read_choice_files(rig, rig_path);
    if (!read) return pass(read.error());
    files = std::move(*read);
    request.library = &*files.library;
    request.has_rows = files.has_rows;
    request.fidelity.probe_us = requested.probe_us ? *requested.probe_us : probe_us();
  }
  auto chosen = sim::choose_simulation(rig.text, request, files.table ? &*files.table : nullptr);
  if (!chosen) return pass(chosen.error());
  return ChosenSimulation{make_note(*chosen, plan, requested), std::move(chosen->rig_json)};
}

void evaluate_promise(SimulationNote& note) {
  if (!note.promise) return;
  SimulationPromise& promise = *note.promise;
  promise.has_run = true;
  const SimulationError error = note.errors.empty() ? SimulationError{} : note.errors.back();
  promise.is_checked = error.worst.samples > 0;
  promise.checked_pairs = error.pairs.size();
  const bool is_known_miss = error.resolved.force_n > promise.requested_n;
  const ForceError largest = is_known_miss ? error.resolved : error.largest();
  promise.measured_n = largest.force_n;
  promise.uncertainty_n = error.worst.uncertainty_n;
  promise.is_resolved = is_known_miss || error.worst.is_resolved;
  promise.held = promise.is_checked && promise.checked_pairs == promise.pairs &&
                 promise.is_resolved && promise.measured_n <= promise.requested_n;
  promise.fabric = largest.fabric;
  promise.exploration = largest.exploration;
  promise.phase = largest.phase;
  promise.at_s = largest.at_s;
}

bool is_measured_miss(const SimulationPromise& promise) {
  return promise.is_checked && promise.is_resolved && promise.measured_n > promise.requested_n;
}

bool is_promise_missed(const SimulationNote& note) {
  return note.promise && note.promise->has_run && !note.promise->held;
}

std::string to_json(const SimulationNote& note) {
  json errors = json::array();
  for (const SimulationError& error : note.errors) errors.push_back(error_json(error));
  json out{{"setting", note.setting}, {"because", note.because}, {"errors", errors}};
  if (note.promise) out["promise"] = *note.promise;
  if (note.budget) out["budget"] = *note.budget;
  if (!note.aside.empty()) out["aside"] = note.aside;
  return out.dump();
}

Result<SimulationNote> simulation_note_from(std::string_view json_text) {
  try {
    const json root = json::parse(json_text);
    SimulationNote note;
    note.setting = root.at("setting").get<std::string>();
    note.level = note.setting.substr(0, note.setting.find(' '));
    note.because = root.at("because").get<std::string>();
    for (const json& each : root.at("errors")) note.errors.push_back(error_from(each));
    if (root.contains("promise")) note.promise = root.at("promise").get<SimulationPromise>();
    if (root.contains("budget")) note.budget = root.at("budget").get<SimulationBudget>();
    return note;
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = "journal",
                 .what = "invalid entry on the simulation",
                 .got = e.what()});
  }
}

std::size_t count_pairs(const recipes::Plan& plan) {
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  for (const recipes::TrialSpec& spec : plan.trials) pairs.insert({spec.fabric, spec.exploration});
  return pairs.size();
}

}  // namespace weft::daemon
