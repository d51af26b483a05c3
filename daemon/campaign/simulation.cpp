#include "daemon/campaign/simulation.hpp"

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

json error_json(const SimulationError& error) {
  const sim::RunError& e = error.worst;
  return {{"setting", e.setting},
          {"reference", e.reference},
          {"trials", error.trials},
          {"samples", e.samples},
          {"worst_fabric", error.worst_fabric},
          {"force_max_n", e.force_max_n},
          {"force_rms_n", e.force_rms_n},
          {"friction_max_n", e.friction_max_n},
          {"friction_rms_n", e.friction_rms_n},
          {"pads", e.pads},
          {"taxels_max_counts", e.counts_max},
          {"taxels_rms_counts", e.counts_rms},
          {"force_max_n_with_transients", e.anywhere_max_n},
          {"same_motion_force_max_n", e.unled_max_n},
          {"same_motion_force_rms_n", e.unled_rms_n}};
}

SimulationError error_from(const json& each) {
  SimulationError out;
  out.worst.setting = each.at("setting").get<std::string>();
  out.worst.reference = each.at("reference").get<std::string>();
  out.trials = each.at("trials").get<std::size_t>();
  out.worst.samples = each.at("samples").get<std::size_t>();
  out.worst_fabric = each.at("worst_fabric").get<std::string>();
  out.worst.force_max_n = each.at("force_max_n").get<double>();
  out.worst.force_rms_n = each.at("force_rms_n").get<double>();
  out.worst.friction_max_n = each.at("friction_max_n").get<double>();
  out.worst.friction_rms_n = each.at("friction_rms_n").get<double>();
  out.worst.pads = each.value("pads", true);
  out.worst.counts_max = each.at("taxels_max_counts").get<double>();
  out.worst.counts_rms = each.at("taxels_rms_counts").get<double>();
  out.worst.anywhere_max_n = each.at("force_max_n_with_transients").get<double>();
  out.worst.unled_max_n = each.at("same_motion_force_max_n").get<double>();
  out.worst.unled_rms_n = each.at("same_motion_force_rms_n").get<double>();
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

}  // namespace weft::daemon
