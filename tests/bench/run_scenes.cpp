#include "tests/bench/run_scenes.hpp"

#include <stdlib.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/campaign/campaign.hpp"

namespace weft::bench {

namespace {

[[noreturn]] void fail_run(const std::string& name, const std::string& why) {
  std::fprintf(stderr, "%s: %s\n", name.c_str(), why.c_str());
  std::exit(1);
}

/// The three files of a run.
struct RunFiles {
  nlohmann::json recipe, rig, fabrics;

  nlohmann::json& device(const char* role) {
    for (nlohmann::json& entry : rig["devices"])
      if (entry["role"] == role) return entry;
    fail_run("bench17", std::string("it has no ") + role);
  }
  nlohmann::json& phases() { return recipe["explorations"].front()["phases"]; }
  nlohmann::json& path() { return phases()[2]["path"]; }
};

struct RunScene {
  const char* name;
  void (*change)(RunFiles& files);
};

nlohmann::json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

void make_press(RunFiles& files) {
  files.recipe["explorations"].front()["kind"] = "press";
  files.phases().erase(2);
}

void take_away_taxels(RunFiles& files) {
  nlohmann::json& devices = files.rig["devices"];
  for (std::size_t i = devices.size(); i-- > 0;)
    if (devices[i]["role"] == "taxels") devices.erase(i);
}

void take_away_noise(RunFiles& files) {
  nlohmann::json& pads = files.rig["simulation"]["pads"];
  for (const char* noise : {"noise_counts", "noise_per_count", "noise_per_square", "drift_counts",
                            "common_mode", "temperature_K"})
    pads[noise] = 0;
  files.device("wrench")["emulator"]["noise_scale"] = 0;
}

template <const char* mechanism>
void switch_off(RunFiles& files) {
  files.rig["simulation"]["switches"][mechanism] = false;
}
constexpr char friction[] = "friction", texture[] = "texture", relaxation[] = "relaxation";

constexpr RunScene run_scenes[] = {
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

/// A bench with stages near the fabric, so that bringing it up is short.
RunFiles common_files() {
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
  files.rig["simulation"]["cover_um"] = 0;  // run-soft-cover sets one
  files.rig["simulation"]["fabrics"] = "fabrics.json";
  files.rig["simulation"]["fidelity"] = std::filesystem::absolute("sim/fidelity.json");
  return files;
}

}  // namespace

std::vector<std::string> run_scene_names() {
  std::vector<std::string> names;
  for (const RunScene& scene : run_scenes) names.emplace_back(scene.name);
  return names;
}

void run_scene(const std::string& name) {
  const auto* scene = std::ranges::find(run_scenes, name, &RunScene::name);
  if (scene == std::end(run_scenes)) fail_run(name, "no such scene");
  std::string folder = std::filesystem::temp_directory_path() / "weft_scene_XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) fail_run(name, "no temporary folder");
  const std::filesystem::path place(folder);
  RunFiles files = common_files();
  scene->change(files);
  std::ofstream(place / "recipe.json") << files.recipe;
  std::ofstream(place / "rig.json") << files.rig;
  std::ofstream(place / "fabrics.json") << files.fabrics;
  daemon::CampaignRequest request{place / "recipe.json", place / "rig.json", place / "out", {}};
  request.error_check = false;
  const auto run = daemon::run_campaign(request, {});
  std::filesystem::remove_all(place);
  if (!run) fail_run(name, to_string(run.error()));
  if (run->error) fail_run(name, to_string(*run->error));
  if (run->outcome != recipes::Outcome::complete) fail_run(name, "not complete");
}

}  // namespace weft::bench
