#include "daemon/campaign/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "sim/rig/simulation_choice.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

/// A force that is held asks for the loop's traces in the data, unless somebody says otherwise.
sim::SimulationRequest simulation_request(const recipes::Plan& plan,
                                          const FidelityRequest& requested) {
  sim::SimulationRequest request{{}, {}, requested.accuracy_n, requested.times_real_time};
  for (const recipes::Exploration& exploration : plan.explorations)
    for (const recipes::PhaseStep& step : exploration.phases)
      if (step.force_n > 0) request.set_points_n.push_back(step.force_n);
  if (!request.set_points_n.empty()) request.traits.push_back(sim::Trait::regulated_force);
  return request;
}

Result<sim::FidelityTable> read_table(const RigFile& rig, const std::filesystem::path& rig_path) {
  constexpr const char* place = "/simulation/fidelity";
  const json root = json::parse(rig.text, nullptr, false);
  const json::json_pointer pointer(place);
  if (root.is_discarded() || !root.contains(pointer) || !root[pointer].is_string())
    return fail({.code = Errc::invalid_argument,
                 .where = place,
                 .what = "the rig file names no table to choose a fidelity from",
                 .expected = "a path relative to the rig file",
                 .hint = "Leave --accuracy and --budget out, or name sim/fidelity.json"});
  const auto text = read_text_file(rig_path.parent_path() / root[pointer].get<std::string>());
  if (!text)
    return fail({.code = text.error().code,
                 .where = place,
                 .what = "the table to choose a fidelity from cannot be read",
                 .expected = "a table made by weft trade sim",
                 .got = text.error().where});
  auto table = sim::parse_fidelity(*text);
  if (!table)
    return fail({.code = table.error().code,
                 .where = place,
                 .what = table.error().what + " in the table of fidelities",
                 .expected = table.error().expected,
                 .got = table.error().got + " at " + table.error().where});
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
  if (!e.is_doubled) return out;
  out["uncertainty_n"] = e.uncertainty_n;
  out["is_resolved"] = e.is_resolved;
  return out;
}

SimulationError error_from(const json& each) {
  SimulationError out;
  out.worst.setting = each.at("setting").get<std::string>();
  out.worst.reference = each.at("reference").get<std::string>();
  out.trials = each.at("trials").get<std::size_t>();
  out.worst.samples = each.at("samples").get<std::size_t>();
  out.worst_fabric = each.at("worst_fabric").get<std::string>();
  out.worst.pads = each.value("pads", true);
  for (const auto& [key, value] : error_figures) out.worst.*value = each.at(key).get<double>();
  out.worst.is_doubled = each.contains("uncertainty_n");
  out.worst.uncertainty_n = each.value("uncertainty_n", 0.0);
  out.worst.is_resolved = each.value("is_resolved", true);
  return out;
}

/// Whether the plant is this process's: that of an emulated bench is weft-rig's.
bool simulated_here(const RigFile& rig) {
  const json root = json::parse(rig.text, nullptr, false);
  return root.is_object() && root.value("bench", json()) == "simulated";
}

}  // namespace

Result<ChosenSimulation> choose_simulation(const RigFile& rig,
                                           const std::filesystem::path& rig_path,
                                           const recipes::Plan& plan,
                                           const FidelityRequest& requested) {
  const bool knob = requested.accuracy_n || requested.times_real_time;
  if (!simulated_here(rig)) {
    if (!knob) return ChosenSimulation{{}, rig.text};
    return fail({.code = Errc::unsupported,
                 .where = "/bench",
                 .what = "there is no simulation here whose fidelity could be chosen",
                 .expected = "a simulated bench",
                 .hint = "Leave --accuracy and --budget out"});
  }
  std::optional<sim::FidelityTable> table;
  if (knob) {
    auto read = read_table(rig, rig_path);
    if (!read) return pass(read.error());
    table = std::move(*read);
  }
  auto chosen = sim::choose_simulation(rig.text, simulation_request(plan, requested),
                                       table ? &*table : nullptr);
  if (!chosen) return pass(chosen.error());
  return ChosenSimulation{{to_string(chosen->setting),
                           std::string(to_string(chosen->setting.level)),
                           chosen->because,
                           {}},
                          std::move(chosen->rig_json)};
}

std::string to_json(const SimulationNote& note) {
  json errors = json::array();
  for (const SimulationError& error : note.errors) errors.push_back(error_json(error));
  return json{{"setting", note.setting}, {"because", note.because}, {"errors", errors}}.dump();
}

Result<SimulationNote> simulation_note_from(std::string_view json_text) {
  try {
    const json root = json::parse(json_text);
    SimulationNote note;
    note.setting = root.at("setting").get<std::string>();
    note.level = note.setting.substr(0, note.setting.find(' '));
    note.because = root.at("because").get<std::string>();
    for (const json& each : root.at("errors")) note.errors.push_back(error_from(each));
    return note;
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = "journal",
                 .what = "not what a run says of its simulation",
                 .got = e.what()});
  }
}

namespace {

void merge(const sim::RunError& found, const std::string& fabric, SimulationError& total) {
  sim::RunError& worst = total.worst;
  if (total.trials == 0 || found.force_max_n > worst.force_max_n) total.worst_fabric = fabric;
  const double before = static_cast<double>(worst.samples),
               more = static_cast<double>(found.samples);
  const auto largest = [&](double& a, double b) { a = std::max(a, b); };
  const auto rms = [&](double& a, double b) {
    if (before + more > 0) a = std::sqrt((before * a * a + more * b * b) / (before + more));
  };
  largest(worst.force_max_n, found.force_max_n);
  largest(worst.friction_max_n, found.friction_max_n);
  largest(worst.counts_max, found.counts_max);
  largest(worst.anywhere_max_n, found.anywhere_max_n);
  largest(worst.unled_max_n, found.unled_max_n);
  largest(worst.uncertainty_n, found.uncertainty_n);
  worst.pads = found.pads;
  worst.is_doubled = found.is_doubled;
  worst.is_resolved = worst.is_resolved && found.is_resolved;
  rms(worst.force_rms_n, found.force_rms_n);
  rms(worst.friction_rms_n, found.friction_rms_n);
  rms(worst.counts_rms, found.counts_rms);
  rms(worst.unled_rms_n, found.unled_rms_n);
  worst.samples += found.samples;
  worst.setting = found.setting;
  worst.reference = found.reference;
  ++total.trials;
}

}  // namespace

bool ErrorCheck::has_fabric(std::size_t fabric) const {
  return std::ranges::any_of(seen_, [&](const Pair& pair) { return pair.first == fabric; });
}

bool ErrorCheck::has_exploration(std::size_t exploration) const {
  return std::ranges::any_of(seen_, [&](const Pair& pair) { return pair.second == exploration; });
}

bool ErrorCheck::is_wanted(const recipes::TrialSpec& spec) const {
  if (trials_.size() >= most_trials) return false;
  if (accuracy_n_) return !seen_.contains({spec.fabric, spec.exploration});
  return !has_fabric(spec.fabric) || !has_exploration(spec.exploration);
}

bool ErrorCheck::has_all() const {
  if (trials_.size() >= most_trials) return true;
  if (accuracy_n_) return seen_.size() >= plan_->fabrics.size() * plan_->explorations.size();
  for (std::size_t i = 0; i < plan_->fabrics.size(); ++i)
    if (!has_fabric(i)) return false;
  for (std::size_t i = 0; i < plan_->explorations.size(); ++i)
    if (!has_exploration(i)) return false;
  return true;
}

void ErrorCheck::patch_follows() {
  if (rig_ != nullptr) rig_->record_motion(!has_all());
}

void ErrorCheck::trial_done(std::size_t trial, bool complete, TimePoint now,
                            const TrialRecording& recording) {
  if (rig_ == nullptr) return;
  auto motion = rig_->extract_motion(now);
  const recipes::TrialSpec& spec = plan_->trials[trial];
  if (!motion || !complete || !is_wanted(spec)) return;
  seen_.insert({spec.fabric, spec.exploration});
  trials_.push_back({trial, std::move(*motion), recording.sampled(), recording.phases()});
}

std::vector<SimulationError> ErrorCheck::errors() const {
  std::vector<SimulationError> out;
  for (const StoredTrial& stored : trials_) {
    const sim::RunError found = rig_->run_error(stored.motion, stored.sampled, accuracy_n_);
    out.resize(1);
    merge(found, plan_->fabrics[plan_->trials[stored.trial].fabric], out.front());
  }
  return out;
}

}  // namespace weft::daemon
