#include "daemon/analysis/tradeoff/sim/recipe_space.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "protocols/base/json_text.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;
using sim::MeasuredRange;

constexpr MeasuredRange force_range_n{0.2, 10}, speed_range_mps{0.5e-3, 4e-3},
    approach_range_mps{1e-3, 4e-3}, seat_speed_range_mps{0.2e-3, 1e-3}, press_range_s{1, 10},
    lambda_range{0.7, 1.4}, stiffness_range_n_m{1e4, 5e4}, slack_range_m{0.6e-3, 3e-3};
constexpr double share_below_weight = 0.2;
constexpr double below_weight = 0.9, above_weight = 1.1;  // the force loop has no set point in
                                                          // between
constexpr int path_count = 4;
constexpr double mm_per_m = 1e3;

/// One column of a Latin hypercube: one number in each of `count` equal parts of [0, 1), shuffled.
std::vector<double> latin_column(std::size_t count, std::uint64_t seed) {
  sim::Random random(seed);
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i)
    out[i] = (static_cast<double>(i) + random.uniform()) / static_cast<double>(count);
  for (std::size_t i = count; i > 1; --i)  // not std::shuffle, which differs between standard
                                           // libraries
    std::swap(out[i - 1], out[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
  return out;
}

double within(const MeasuredRange& range, double share) {
  return range.least + share * (range.most - range.least);
}

/// Evenly distributed in the logarithm.
double within_log(const MeasuredRange& range, double share) {
  return std::min(range.most, range.least * std::pow(range.most / range.least, share));
}

double force_of(double share, double weight_n) {
  if (share < share_below_weight)
    return within({force_range_n.least, std::max(force_range_n.least, below_weight * weight_n)},
                  share / share_below_weight);
  return within({above_weight * weight_n, force_range_n.most},
                (share - share_below_weight) / (1 - share_below_weight));
}

ordered_json path_of(const RecipeScene& scene) {
  constexpr double least_mm = 4, most_mm = 12, slide_s = 4, press_mm = 0.5;
  const double leg_mm = std::clamp(slide_s * scene.speed_mps * mm_per_m, least_mm, most_mm);
  const auto leg = [](double dx_mm, double dy_mm) {
    return ordered_json{{"dx_mm", dx_mm}, {"dy_mm", dy_mm}};
  };
  switch (scene.path) {
    case ScenePath::press:
      return ordered_json::array({leg(0, press_mm)});
    case ScenePath::straight:
      return ordered_json::array({leg(0, leg_mm)});
    case ScenePath::corner:
      return ordered_json::array({leg(0, leg_mm), leg(leg_mm, 0)});
    case ScenePath::diagonal:
      return ordered_json::array({leg(leg_mm, leg_mm)});
  }
  return {};
}

Result<nlohmann::json> parse_object(std::string_view text, const char* where) {
  auto root = parse_json(text);
  if (!root) return pass(root.error(), where);
  if (root->is_object()) return root;
  return fail({.code = Errc::parse, .where = where, .what = "not a JSON object"});
}

}  // namespace

void write_ranges(sim::TableConditions& conditions) {
  conditions.force_n = force_range_n;
  conditions.speed_mps = speed_range_mps;
  conditions.seat_speed_mps = seat_speed_range_mps;
  conditions.press_s = press_range_s;
  conditions.mount_stiffness_n_m = stiffness_range_n_m;
  conditions.slack_m = slack_range_m;
}

std::vector<RecipeScene> draw_recipe_scenes(const std::vector<std::string>& fabrics,
                                            double weight_n, std::size_t count,
                                            std::uint64_t seed) {
  const auto column = [&](std::string_view name) {
    return latin_column(count, sim::mix(seed, name));
  };
  const auto force = column("force"), speed = column("speed"), approach = column("approach"),
             seat = column("seat"), press = column("press"), path = column("path"),
             cloth = column("cloth"), lambda = column("lambda"), stiffness = column("stiffness"),
             slack = column("slack");
  std::vector<RecipeScene> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto pick = [](double share, std::size_t choices) {
      return std::min(choices - 1, static_cast<std::size_t>(share * static_cast<double>(choices)));
    };
    out[i] = {.force_n = force_of(force[i], weight_n),
              .speed_mps = within(speed_range_mps, speed[i]),
              .approach_mps = within(approach_range_mps, approach[i]),
              .seat_speed_mps = within(seat_speed_range_mps, seat[i]),
              .press_s = within(press_range_s, press[i]),
              .path = static_cast<ScenePath>(pick(path[i], path_count)),
              .fabric = fabrics[pick(cloth[i], fabrics.size())],
              .lambda_scale = within_log(lambda_range, lambda[i]),
              .mount_stiffness_n_m = within_log(stiffness_range_n_m, stiffness[i]),
              .slack_m = within(slack_range_m, slack[i])};
  }
  return out;
}

std::string scene_recipe(const RecipeScene& scene, std::uint64_t seed) {
  constexpr double least_band_n = 0.05, band_share = 0.05;
  const double band_n =
      std::min(std::max(least_band_n, band_share * scene.force_n), scene.force_n / 2);
  const auto held = [&](ordered_json phase) {
    phase["force_N"] = scene.force_n;
    phase["force_band_N"] = band_n;
    return phase;
  };
  ordered_json phases = ordered_json::array();
  phases.push_back({{"phase", "S"}, {"duration_s", 1}});
  phases.push_back(held({{"phase", "P"}, {"duration_s", scene.press_s}}));
  phases.push_back(
      held({{"phase", "M"}, {"speed_mm_s", scene.speed_mps * mm_per_m}, {"path", path_of(scene)}}));
  phases.push_back({{"phase", "E"}, {"duration_s", 1}});
  return ordered_json{{"schema_version", 1},
                      {"name", "scene"},
                      {"source", "weft trade sim --table"},
                      {"seed", seed},
                      {"fabrics", {scene.fabric}},
                      {"repetitions", 1},
                      {"approach",
                       {{"speed_mm_s", scene.approach_mps * mm_per_m},
                        {"seat_speed_mm_s", scene.seat_speed_mps * mm_per_m}}},
                      {"explorations", {{"X", {{"phases", phases}}}}}}
      .dump();
}

Result<std::string> scene_rig(std::string_view base_rig, const RecipeScene& scene) {
  constexpr double plate_mm = 60, surface_mm = 16, start_mm = 4;
  auto rig = parse_object(base_rig, "rig file");
  if (!rig) return pass(rig.error());
  try {
    nlohmann::json& root = *rig;
    root["probe"]["slack_mm"] = scene.slack_m * mm_per_m;
    root["probe"]["rest_travel_mm"] = scene.slack_m * mm_per_m / 2;
    root["plate"]["surface_z_mm"] = surface_mm;
    root["plate"]["size_mm"] = {plate_mm, plate_mm};
    nlohmann::json& simulation = root["simulation"];
    simulation["mount_stiffness_n_m"] = scene.mount_stiffness_n_m;
    simulation["fabrics"] = "fabrics.json";
    for (nlohmann::json& device : root["devices"]) {
      const std::string role = device.value("role", "");
      if (role == "x" || role == "y" || role == "z") device["emulator"]["start_mm"] = start_mm;
    }
    return root.dump();
  } catch (const nlohmann::json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = "rig file",
                 .what = "not a rig file of a simulated bench",
                 .got = e.what()});
  }
}

// Pressure follows e^{d/lambda} from p_s on. If all lengths are scaled by s, the work of
// compression scales by s too, and its linearity is unchanged.
Result<std::string> scene_fabrics(std::string_view fabrics_json, const RecipeScene& scene) {
  auto table = parse_object(fabrics_json, "cloth table");
  if (!table) return pass(table.error());
  try {
    for (nlohmann::json& fabric : table->at("fabrics")) {
      if (fabric.at("name") != scene.fabric) continue;
      nlohmann::json& work = fabric.at("WC_gfcm_cm2").at(0);
      work = work.get<double>() * scene.lambda_scale;
      return table->dump();
    }
  } catch (const nlohmann::json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = "cloth table",
                 .what = "not a fabric table",
                 .got = e.what()});
  }
  return fail({.code = Errc::not_found,
               .where = "cloth table",
               .what = "unknown fabric",
               .got = scene.fabric});
}

}  // namespace weft::daemon
