#include "daemon/campaign/setup/rig_writer.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/installed_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/setup/device_config.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;
namespace apt = protocols::apt;
using Json = nlohmann::ordered_json;

constexpr double real_time_cycle_hz = 250, cycle_hz = 100;

StageLimits limits_of(const RigDraft& draft) {
  StageLimits out;
  for (const DraftDevice& device : draft.devices) {
    const apt::StageModel* const stage = apt::find_stage(device.stage);
    if (device.role == no_role || stage == nullptr) continue;
    if (stage->axis == apt::Axis::linear) {
      out.acceleration_mm_s2 = std::min(out.acceleration_mm_s2, stage->max_acceleration);
    } else {
      out.tilt_speed_deg_s = std::min(out.tilt_speed_deg_s, stage->max_speed);
      out.tilt_acceleration_deg_s2 =
          std::min(out.tilt_acceleration_deg_s2, stage->max_acceleration);
    }
  }
  return out;
}

Json device_json(const DraftDevice& device, const RigDraft& draft, const StageLimits& limits) {
  const FoundDevice& found = device.found;
  const bool is_stage = found.kind == DeviceKind::stage;
  Json out{{"name", is_stage ? "stage." + device.role : std::string(device_name(device))},
           {"role", device.role},
           {"driver", driver_name(found.kind)},
           {"config", device_config(device, draft, limits)},
           {"link", link_json(found.link)}};
  if (found.http) out["http"] = link_json(*found.http);
  if (draft.mode != BenchMode::real) out["emulator"] = emulator_json(device);
  return out;
}

/// Numbers several tactile arrays: taxels, taxels2, taxels3.
void number_arrays(Json& devices) {
  int arrays = 0;
  for (Json& device : devices)
    if (device["role"] == "taxels" && ++arrays > 1)
      device["name"] = device["name"].get<std::string>() + std::to_string(arrays);
}

/// In the order of the roles, for human readers.
Json devices_json(const RigDraft& draft, const StageLimits& limits) {
  Json out = Json::array();
  for (const char* const role : {"x", "y", "z", "rx", "ry", "wrench", "taxels", "vibro"})
    for (const DraftDevice& device : draft.devices)
      if (device.role == role) out.push_back(device_json(device, draft, limits));
  number_arrays(out);
  return out;
}

Json limits_json(const RigDraft& draft, const StageLimits& limits) {
  Json out{{"speed_mm_s", draft.number("speed_mm_s")},
           {"acceleration_mm_s2", limits.acceleration_mm_s2}};
  const double tilt = draft.number("tilt_deg");
  if (draft.needs("tilt_deg")) out["tilt_speed_deg_s"] = limits.tilt_speed_deg_s;
  if (draft.has_wrench()) {
    out["force_cap_N"] = draft.number("force_cap_n");
    out["torque_cap_Nm"] = draft.number("torque_cap_nm");
  } else {
    out["taxel_cap_counts"] = draft.number("taxel_cap_counts");
    out["press_depth_mm"] = draft.number("press_depth_mm");
  }
  for (const char* const axis : {"x", "y", "z"})
    if (const DraftDevice* const device = draft.with_role(axis))
      out["travel_mm"][axis] = travel_of(*device, draft);
  if (draft.needs("tilt_deg")) out["tilt_deg"] = {-tilt, tilt};
  return out;
}

Json probe_json(const RigDraft& draft) {
  const double face = draft.number("probe_face_mm");
  Json out{{"mass_kg", draft.number("probe_mass_kg")}, {"rest_travel_mm", 0.5}};
  // The slack of a real mount must be measured.
  if (draft.mode != BenchMode::real) out["slack_mm"] = 1.0;
  out["footprint_mm"] = {face, face};
  out["clearance_mm"] = draft.number("clearance_mm");
  if (!draft.has_wrench()) out["touch_counts"] = draft.number("touch_counts");
  return out;
}

Json fixed_json(const RigDraft& draft) {
  Json out;
  for (const char* const key : {"y_mm", "rx_deg", "ry_deg"})
    if (draft.needs("fixed_" + std::string(key)))
      out[key] = draft.number("fixed_" + std::string(key));
  return out;
}

/// Faster in real time: docs of sim/rigs. Not with a slow force sensor.
double cycle_of(const RigDraft& draft) {
  if (draft.mode == BenchMode::simulated) return cycle_hz;
  const DraftDevice* const wrench = draft.with_role("wrench");
  const bool is_slow = wrench != nullptr && wrench->found.rate_hz < real_time_cycle_hz;
  return is_slow ? cycle_hz : real_time_cycle_hz;
}

Result<fs::path> table(const char* name) {
  const fs::path file = find_installed(name);
  std::error_code error;
  if (fs::exists(file, error)) return fs::absolute(file, error).lexically_normal();
  return fail({.code = Errc::not_found,
               .where = name,
               .what = "simulation table not found",
               .hint = "Run Weft from the source tree, or install the package weft"});
}

Status add_simulation(const RigDraft& draft, Json& rig) {
  const DraftDevice* const taxels = draft.with_role("taxels");
  const bool has_imprints = taxels != nullptr && taxels->found.kind == DeviceKind::imprint_array;
  const auto fabrics = table(has_imprints ? "sim/objects.json" : "sim/fabrics.json");
  if (!fabrics) return pass(fabrics.error());
  const auto fidelity = table("sim/fidelity.json");
  if (!fidelity) return pass(fidelity.error());
  const auto text = read_text_file(*fabrics);
  if (!text) return pass(text.error());
  const auto document = parse_json(*text);
  if (!document) return pass(document.error(), fabrics->string());
  for (const auto& fabric : (*document)["fabrics"])
    rig["fabrics"].push_back(fabric.at("name").get<std::string>());
  Json& simulation = rig["simulation"];
  simulation = {{"level", "auto"},
                {"traits", {"relaxation", "regulated_force"}},
                {"fidelity", fidelity->string()},
                {"fabrics", fabrics->string()}};
  if (draft.mode == BenchMode::emulated)
    simulation["console"] = {{"host", draft.console.host}, {"port", draft.console.port}};
  return {};
}

/// One line per member and one per device.
std::string formatted(const Json& rig) {
  std::string out = "{";
  for (const auto& [key, value] : rig.items()) {
    out += (out == "{" ? "\n  " : ",\n  ") + Json(key).dump() + ": ";
    if (key != "devices") {
      out += value.dump();
      continue;
    }
    out += "[";
    for (const Json& device : value) {
      out += out.back() == '[' ? "\n    {" : ",\n    {";
      for (const auto& [name, member] : device.items())
        out += (out.back() == '{' ? "\n      " : ",\n      ") + Json(name).dump() + ": " +
               member.dump();
      out += "\n    }";
    }
    out += "\n  ]";
  }
  return out + "\n}\n";
}

std::string_view bench_name(BenchMode mode) {
  if (mode == BenchMode::simulated) return "simulated";
  return mode == BenchMode::emulated ? "emulated" : "real";
}

tl::unexpected<Error> cannot_write(const fs::path& target, int number) {
  return fail({.code = Errc::io,
               .where = target.string(),
               .what = "rig file not written",
               .got = std::generic_category().message(number)});
}

tl::unexpected<Error> already_there(const fs::path& target) {
  return fail({.code = Errc::wrong_state,
               .where = target.string(),
               .what = "file already exists",
               .expected = "a new file",
               .hint = "Choose another name, or move the file away"});
}

/// Fails if the file exists. Does not use a hard link, which some file systems lack.
Status write_new_file(const fs::path& target, const std::string& text) {
  std::FILE* const file = std::fopen(target.c_str(), "wxe");
  if (file == nullptr) return errno == EEXIST ? already_there(target) : cannot_write(target, errno);
  bool is_whole = std::fwrite(text.data(), 1, text.size(), file) == text.size() &&
                  std::fflush(file) == 0 && ::fsync(::fileno(file)) == 0;
  int number = errno;
  if (std::fclose(file) != 0 && std::exchange(is_whole, false)) number = errno;
  if (is_whole) return sync_folder(target.has_parent_path() ? target.parent_path() : ".");
  ::unlink(target.c_str());
  return cannot_write(target, number);
}

fs::path library() {
  const fs::path in_tree = find_installed("recipes/library");
  std::error_code error;
  return fs::exists(in_tree, error) ? in_tree : find_installed("recipes");
}

/// Recipes for a first campaign, then the others.
std::vector<std::string> recipe_names(bool has_imprints) {
  std::vector<std::string> out{"first.json", "first-along-x.json", "first-by-depth.json"};
  out.insert(has_imprints ? out.begin() : out.end(), "imprint.json");
  std::set<std::string> others;
  std::error_code error;
  for (const auto& file : fs::directory_iterator(library(), error))
    if (file.path().extension() == ".json") others.insert(file.path().filename().string());
  for (const std::string& one : out) others.erase(one);
  out.insert(out.end(), others.begin(), others.end());
  return out;
}

}  // namespace

Result<std::string> rig_text(const RigDraft& draft) {
  const StageLimits limits = limits_of(draft);
  Json rig{{"name", draft.name},
           {"bench", bench_name(draft.mode)},
           {"devices", devices_json(draft, limits)}};
  if (const Json fixed = fixed_json(draft); !fixed.empty()) rig["fixed"] = fixed;
  rig["limits"] = limits_json(draft, limits);
  rig["probe"] = probe_json(draft);
  rig["plate"] = {{"origin_mm", {0, 0}},
                  {"surface_z_mm", draft.number("surface_z_mm")},
                  {"size_mm", {draft.number("plate_x_mm"), draft.number("plate_y_mm")}}};
  rig["control"] = {{"cycle_hz", cycle_of(draft)}};
  if (draft.mode != BenchMode::real)
    if (Status added = add_simulation(draft, rig); !added) return pass(added.error());
  return formatted(rig);
}

Status require_new_file(const fs::path& target) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(target, error))) return already_there(target);
  return check_target(target);
}

// Checked in the target's folder, because paths in the file are relative to it.
Status write_rig(const RigDraft& draft, const fs::path& target) {
  const auto text = rig_text(draft);
  if (!text) return pass(text.error());
  AtomicFile file(target);
  if (Status written = write_text_file(file.temporary(), *text); !written) return written;
  if (const Status checked = check_rig_file(file.temporary()); !checked) {
    Error refused = checked.error();
    const std::string name = file.temporary().string();
    if (refused.where.starts_with(name))
      refused.where = target.string() + refused.where.substr(name.size());
    return fail(std::move(refused));
  }
  return write_new_file(target, *text);
}

std::string suitable_recipe(const RigDraft& draft, const fs::path& rig) {
  const DraftDevice* const taxels = draft.with_role("taxels");
  const bool has_imprints = taxels != nullptr && taxels->found.kind == DeviceKind::imprint_array;
  for (const std::string& name : recipe_names(has_imprints)) {
    CampaignRequest request;
    request.recipe = library() / name;
    request.rig = rig;
    const auto checked = preflight(request, PluginDrivers::unread);
    if (checked && checked->plan && checked->problems.empty()) return request.recipe.string();
  }
  return {};
}

}  // namespace weft::daemon
