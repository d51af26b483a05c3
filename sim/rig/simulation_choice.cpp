#include "sim/rig/simulation_choice.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "sim/plant/bounds.hpp"
#include "sim/plant/field_reader.hpp"
#include "sim/rig/rig_config.hpp"

namespace weft::sim {

namespace {

using nlohmann::ordered_json;

Scene make_scene(const RigConfig& config, const SimulationRequest& request) {
  Scene scene = config.scene;
  if (config.level_by_hand) return scene;
  for (const Trait trait : request.traits)
    if (!is_needed(scene, trait)) scene.traits.push_back(trait);
  return scene;
}

std::string needs(const Scene& scene) {
  return "the scene needs " + format_needs(scene);
}

/// Without a requested accuracy or speed the level is that of the rig file or of the scene.
Result<SimulationChoice> by_scene(const RigConfig& config, const Scene& scene) {
  SimulationChoice choice{setting_of(config.bench_plant.plant), {}, {}};
  if (config.level_by_hand) {
    const bool earlier = config.chosen_setting == to_string(choice.setting);
    choice.because = earlier ? config.chosen_because : "the rig file names it";
    return choice;
  }
  const auto least = least_level(scene);
  if (!least) return fail_at(level_place, least.error());
  PlantParams plant = config.bench_plant.plant;
  plant.level = *least;
  choice.setting = setting_of(plant);
  choice.because = needs(scene);
  return choice;
}

/// The forecast's speed is left out, because each process measures it anew and the text is kept in
/// the recorded rig file.
std::string format_request(const FidelityRequest& request, const FidelityOffer& offer) {
  const std::string promised =
      printed(" (promises %.3g mN", offer.promise_n * 1e3) + " on " + offer.limiting_fabric + ")";
  const std::string error =
      request.accuracy_n ? printed(" within %.4g mN", *request.accuracy_n * 1e3) : std::string();
  const std::string speed = request.times_real_time
                                ? printed("%.4g times real time", *request.times_real_time)
                                : std::string();
  if (!request.accuracy_n) return "the most accurate setting at " + speed + promised;
  return "the fastest setting" + error + (speed.empty() ? "" : " and over " + speed) + promised;
}

constexpr const char* other_cloths =
    "; the table was measured with another cloth table, so its errors for any cloth are taken";

ForceScene make_force_scene(const RigConfig& config, const SimulationRequest& request) {
  const PlantParams& plant = config.bench_plant.plant;
  ForceScene out{.fabrics = request.fabrics,
                 .speed_mps = request.speed_mps,
                 .press_s = request.press_s,
                 .seat_speed_mps = request.seat_speed_mps,
                 .face_area_m2 = plant.geometry.face_area_m2(),
                 .mount = plant.mount,
                 .library = request.library,
                 .has_rows = request.has_rows};
  if (request.set_points_n.empty()) return out;
  const auto [least, most] = std::ranges::minmax(request.set_points_n);
  out.force_n = {least, most};
  return out;
}

Result<SimulationChoice> by_table(const RigConfig& config, const Scene& scene,
                                  const SimulationRequest& request, const FidelityTable* table) {
  if (table == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/simulation/fidelity",
                 .what = "fidelity table missing",
                 .expected = "a path relative to the rig file",
                 .got = "none",
                 .hint = "Name a table such as sim/fidelity.json, made by weft trade sim --table"});
  const ForceScene forces = make_force_scene(config, request);
  FidelityRequest fidelity = request.fidelity;
  fidelity.run.has_pads = config.bench_plant.plant.watched.pads;
  if (config.level_by_hand) fidelity.level = config.bench_plant.plant.level;
  const auto offer = choose(*table, scene, forces, fidelity);
  if (!offer) return fail_at(level_place, offer.error());
  SimulationChoice out{offer->setting,
                       needs(scene) + ", and this is " + format_request(fidelity, *offer) +
                           (request.has_rows ? "" : other_cloths),
                       {},
                       *offer};
  fidelity.promise_below_n = offer->promise_n;
  if (auto next = choose(*table, scene, forces, fidelity)) out.next = std::move(*next);
  return out;
}

/// L0 has one force and no phases: all set points must be equal.
Status write_set_point(const RigConfig& config, const SimulationRequest& request,
                       ordered_json& simulation) {
  // The release finds the upper end of the slack by a force clearly above the weight.
  const double least_n = 1.2 * config.bench_plant.plant.mount.weight_n();
  const auto too_light = [least_n](double force_n) {
    return fail({.code = Errc::unsupported,
                 .where = level_place,
                 .what = "force too small for level L0",
                 .expected = "L1 or above, or set points of at least " + printed("%g N", least_n),
                 .got = "L0, with " + printed("%g N", force_n),
                 .hint = "Choose level L1 or above"});
  };
  if (config.set_point_by_hand && config.bench_plant.plant.set_point_n < least_n)
    return too_light(config.bench_plant.plant.set_point_n);
  if (config.set_point_by_hand || request.set_points_n.empty()) return {};
  const auto [least, most] =
      std::minmax_element(request.set_points_n.begin(), request.set_points_n.end());
  if (*least != *most)
    return fail({.code = Errc::unsupported,
                 .where = level_place,
                 .what = "several set points not allowed at level L0",
                 .expected = "L1 or above",
                 .got = "L0, with " + printed("%g to ", *least) + printed("%g N", *most),
                 .hint = "Choose level L1 or above, or set one force in simulation.set_point_n"});
  if (*least < least_n) return too_light(*least);
  simulation["set_point_n"] = *least;
  return {};
}

void write_setting(const FidelitySetting& setting, ordered_json& simulation) {
  if (setting.level >= Level::quasistatic)
    simulation["step_us"] = std::round(setting.step_s * 1e9) / 1e3;  // reads back as written
  if (setting.level >= Level::dynamic)
    simulation["dynamics"]["integrator"] = to_string(setting.integrator);
}

}  // namespace

Result<SimulationChoice> choose_simulation(std::string_view rig_json,
                                           const SimulationRequest& request,
                                           const FidelityTable* table) {
  const auto config = parse_rig_config(rig_json);
  if (!config) return pass(config.error());
  const bool knob = request.uses_table() || request.recorded;
  const Scene scene = make_scene(*config, request);
  auto choice = request.recorded ? SimulationChoice{*request.recorded, request.recorded_because, {}}
                : knob           ? by_table(*config, scene, request, table)
                                 : by_scene(*config, scene);
  if (!choice) return choice;
  choice->rig_json = rig_json;
  const bool open = knob || !config->level_by_hand;
  if (!open && choice->setting.level != Level::algebraic) return choice;
  auto rig = ordered_json::parse(rig_json);
  ordered_json& simulation = rig["simulation"];
  if (choice->setting.level == Level::algebraic)
    if (Status s = write_set_point(*config, request, simulation); !s) return pass(s.error());
  if (open) {
    simulation["level"] = to_string(choice->setting.level);
    simulation["chosen"] = {{"setting", to_string(choice->setting)}, {"because", choice->because}};
  }
  // A later version may choose another default step for level L2.
  if (knob || (open && choice->setting.level >= Level::dynamic))
    write_setting(choice->setting, simulation);
  choice->rig_json = rig.dump(2);
  return choice;
}

}  // namespace weft::sim
