#pragma once
// Whole runs of one short trial on denim, each with something taken away from or put into a common
// scene: the simulated bench17 at level L1, cloth under a rigid cover, no wear.

#include <stdlib.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/campaign/campaign.hpp"

namespace weft::bench {

/// The three files of a run.
struct RunFiles {
  nlohmann::json recipe, rig, fabrics;

  nlohmann::json& device(const char* role) {
    for (nlohmann::json& entry : rig["devices"])
      if (entry["role"] == role) return entry;
    std::fprintf(stderr, "the rig has no %s\n", role);
    std::exit(1);
  }
  nlohmann::json& phases() { return recipe["explorations"].front()["phases"]; }
  nlohmann::json& path() { return phases()[2]["path"]; }
};

struct RunScene {
  const char* name;
  void (*change)(RunFiles& files);
};

inline nlohmann::json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

inline void make_press(RunFiles& files) {
  files.recipe["explorations"].front()["kind"] = "press";
  files.phases().erase(2);
}

inline void take_away_taxels(RunFiles& files) {
  nlohmann::json& devices = files.rig["devices"];
  for (std::size_t i = devices.size(); i-- > 0;)
    if (devices[i]["role"] == "taxels") devices.erase(i);
}

inline void take_away_noise(RunFiles& files) {
  nlohmann::json& pads = files.rig["simulation"]["pads"];
  pads["noise_counts"] = pads["drift_counts"] = 0;
  files.device("wrench")["emulator"]["noise_scale"] = 0;
}

template <const char* mechanism>
void switch_off(RunFiles& files) {
  files.rig["simulation"]["switches"][mechanism] = false;
}
inline constexpr char friction[] = "friction", texture[] = "texture", relaxation[] = "relaxation";

inline constexpr RunScene run_scenes[] = {
    {"run-press", make_press},
    {"run-M1", [](RunFiles&) {}},
    {"run-M2",
     [](RunFiles& files) {
       files.path().push_back({{"dx_mm", 6}, {"dy_mm", 0}});
     }},
    {"run-no-taxels", take_away_taxels},
    {"run-no-noise", take_away_noise},
    {"run-no-friction", switch_off<friction>},
    {"run-no-texture", switch_off<texture>},
    {"run-no-relaxation", switch_off<relaxation>},
    {"run-soft-cover", [](RunFiles& files) { files.rig["simulation"]["cover_um"] = 60; }},
    {"run-wear",
     [](RunFiles& files) {
       files.fabrics["parameters"]["wear_most"] = {0.3, "estimated"};
     }},
    {"run-L0",
     [](RunFiles& files) {
       files.rig["simulation"]["level"] = "L0";
       files.rig["simulation"]["traits"] = {"mean_level"};
     }},
    {"run-L3", [](RunFiles& files) {
       const nlohmann::json with_vibro = read_json("sim/rigs/vibro17.json");
       for (const nlohmann::json& entry : with_vibro["devices"])
         if (entry["role"] == "vibro") files.rig["devices"].push_back(entry);
     }}};

/// A bench whose stages stand near the cloth, so that bringing it up is short.
inline RunFiles common_files() {
  RunFiles files{nlohmann::json::parse(R"({
    "schema_version": 1, "name": "scene", "source": "scene costs", "seed": 1, "repetitions": 1,
    "fabrics": ["denim"], "explorations": {"E1": {"phases": [
      {"phase": "S", "duration_s": 1},
      {"phase": "P", "force_N": 5, "force_band_N": 0.25, "duration_s": 2},
      {"phase": "M", "force_N": 5, "force_band_N": 0.25, "speed_mm_s": 2,
       "path": [{"dx_mm": 0, "dy_mm": 6}]},
      {"phase": "E", "duration_s": 1}]}}})"),
                 read_json("sim/rigs/bench17.json"), read_json("sim/fabrics.json")};
  files.rig["plate"]["surface_z_mm"] = 16;
  files.rig["plate"]["size_mm"] = {34, 34};
  for (const char* role : {"x", "y", "z"}) files.device(role)["emulator"]["start_mm"] = 4;
  files.rig["simulation"]["fabrics"] = "fabrics.json";
  files.rig["simulation"]["fidelity"] = std::filesystem::absolute("sim/fidelity.json");
  return files;
}

/// Runs it in a folder of its own, without the error check, whose replays are finer than the scene.
inline void run_scene(const RunScene& scene) {
  std::string folder = std::filesystem::temp_directory_path() / "weft_scene_XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) std::exit(1);
  const std::filesystem::path place(folder);
  RunFiles files = common_files();
  scene.change(files);
  std::ofstream(place / "recipe.json") << files.recipe;
  std::ofstream(place / "rig.json") << files.rig;
  std::ofstream(place / "fabrics.json") << files.fabrics;
  daemon::CampaignRequest request{place / "recipe.json", place / "rig.json", place / "out", {}};
  request.error_check = false;
  const auto run = daemon::run_campaign(request, {});
  const bool complete = run && run->outcome == recipes::Outcome::complete;
  if (!run) std::fprintf(stderr, "%s: %s\n", scene.name, to_string(run.error()).c_str());
  if (run && run->error)
    std::fprintf(stderr, "%s: %s\n", scene.name, to_string(*run->error).c_str());
  std::filesystem::remove_all(place);
  if (!complete) std::exit(1);
}

}  // namespace weft::bench
