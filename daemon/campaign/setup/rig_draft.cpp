#include "daemon/campaign/setup/rig_draft.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/base/text/format.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {
namespace {

namespace apt = protocols::apt;
using nlohmann::json;

constexpr std::array<std::string_view, 3> linear_roles{"x", "y", "z"};
constexpr std::array<std::string_view, 2> rotary_roles{"rx", "ry"};

constexpr NumberKey keys[] = {
    {"surface_z_mm", "position of the z stage at which the probe touches the bare plate [mm]", 0,
     1000, true},
    {"plate_x_mm", "size of the plate along x [mm]", 1, 1000},
    {"plate_y_mm", "size of the plate along y [mm]", 1, 1000},
    {"probe_mass_kg", "mass of the probe that rests on the fabric [kg]", 0.001, 10, true},
    {"probe_face_mm", "side of the probe's face [mm]", 1, 500},
    {"clearance_mm", "height over the plate that is clear of every fabric [mm]", 0.5, 100},
    {"force_cap_n", "largest permitted force [N]", 0.1, 1000, true},
    {"torque_cap_nm", "largest permitted torque [N m]", 0.01, 100, true},
    {"counts_per_newton", "counts per newton of the Net F/T box (its web pages were not read)", 1,
     1e9, true},
    {"counts_per_newton_metre", "counts per newton metre of the same box", 1, 1e9, true},
    {"taxel_cap_counts", "largest permitted change of a taxel [counts]", 1, 65535, true},
    {"press_depth_mm", "largest depth of z below the first contact [mm]", 0.01, 50, true},
    {"touch_counts", "mean change of the taxels that counts as contact [counts]", 1, 65535, true},
    {"speed_mm_s", "largest speed of the linear stages [mm/s]", 0.01, 500},
    {"tilt_deg", "largest angle of the rotary stages in either direction [deg]", 0.1, 180},
    {"fixed_y_mm", "position of y, which has no stage [mm]", -1000, 1000},
    {"fixed_rx_deg", "position of rx, which has no stage [deg]", -90, 90},
    {"fixed_ry_deg", "position of ry, which has no stage [deg]", -90, 90},
};

std::string_view sensor_role(DeviceKind kind) {
  if (kind == DeviceKind::net_ft || kind == DeviceKind::digital_ft) return "wrench";
  if (kind == DeviceKind::vibration_sensor) return "vibro";
  if (kind == DeviceKind::taxel_array || kind == DeviceKind::imprint_array) return "taxels";
  return no_role;
}

/// Numbers in their order, then other texts.
bool serial_before(const DraftDevice* a, const DraftDevice* b) {
  const auto key = [](const DraftDevice* d) {
    return std::pair(d->found.serial.size(), d->found.serial);
  };
  return key(a) < key(b);
}

/// Assigns models to stages of one axis without a stated one, ordered by serial number.
void assign_stages(RigDraft& draft, apt::Axis axis) {
  std::vector<DraftDevice*> free;
  std::vector<std::string_view> taken;
  for (DraftDevice& device : draft.devices) {
    if (axis_of(device) != axis) continue;
    if (!device.is_role_stated)
      free.push_back(&device);
    else if (device.role != no_role)
      taken.push_back(device.role);
  }
  std::ranges::sort(free, serial_before);
  std::vector<std::string_view> names(rotary_roles.begin(), rotary_roles.end());
  if (axis == apt::Axis::linear) names.assign(linear_roles.begin(), linear_roles.end());
  const std::size_t count = free.size() + taken.size();
  if (axis == apt::Axis::linear && count == 2) names = {"x", "z"};
  if (axis == apt::Axis::linear && count == 1) names = {"z"};
  std::erase_if(
      names, [&](std::string_view name) { return std::ranges::find(taken, name) != taken.end(); });
  for (std::size_t i = 0; i < std::min(free.size(), names.size()); ++i) free[i]->role = names[i];
}

void assign_roles(RigDraft& draft) {
  for (DraftDevice& device : draft.devices)
    if (!device.is_role_stated) device.role = no_role;
  for (const apt::Axis axis : {apt::Axis::linear, apt::Axis::rotary}) assign_stages(draft, axis);
  for (DraftDevice& device : draft.devices) {
    const FoundDevice& found = device.found;
    if (device.is_role_stated || found.kind == DeviceKind::stage) continue;
    if (draft.mode == BenchMode::real && found.kind == DeviceKind::net_ft && !found.is_expected)
      continue;
    const std::string_view role = sensor_role(found.kind);
    const DraftDevice* const other = draft.with_role(role);
    if (other == nullptr || can_share_role(*other, device)) device.role = role;
  }
}

DraftDevice* find_device(RigDraft& draft, std::string_view name) {
  const auto is_named = [&](const DraftDevice& device) {
    const auto* port = std::get_if<SerialSettings>(&device.found.link);
    return device.found.place == name || (port != nullptr && port->path == name) ||
           (!device.found.serial.empty() && device.found.serial == name);
  };
  const auto at = std::ranges::find_if(draft.devices, is_named);
  return at == draft.devices.end() ? nullptr : &*at;
}

tl::unexpected<Error> no_device(const RigDraft& draft, std::string_view name) {
  std::string places;
  for (const DraftDevice& device : draft.devices)
    places += (places.empty() ? "" : ", ") + device.found.place;
  return fail({.code = Errc::not_found,
               .where = std::string(name),
               .what = "device not found",
               .expected = places.empty() ? "a device of the search" : places});
}

double travel_mm(const RigDraft& draft, std::string_view role) {
  constexpr double usual = 150;
  const DraftDevice* const device = draft.with_role(role);
  const apt::StageModel* const stage = device == nullptr ? nullptr : apt::find_stage(device->stage);
  return stage == nullptr ? usual : std::min(usual, stage->travel_high);
}

double default_number(const RigDraft& draft, std::string_view name) {
  const bool is_real = draft.mode == BenchMode::real;
  const auto plate_y = [&] {
    return travel_mm(draft, draft.with_role("y") != nullptr ? "y" : "x");
  };
  constexpr double surface_share = 0.4;  // of the travel: leaves room above and below
  constexpr double clearance_mm = 8;     // or half of the travel of a short stage above the plate
  const std::map<std::string_view, double> fixed{{"probe_mass_kg", 0.2},
                                                 {"probe_face_mm", 16},
                                                 {"torque_cap_nm", 2},
                                                 {"taxel_cap_counts", 8000},
                                                 {"press_depth_mm", 2},
                                                 {"touch_counts", 20},
                                                 {"tilt_deg", 5},
                                                 {"fixed_rx_deg", 0},
                                                 {"fixed_ry_deg", 0},
                                                 {"counts_per_newton", 1e6},
                                                 {"counts_per_newton_metre", 1e6}};
  if (const auto at = fixed.find(name); at != fixed.end()) return at->second;
  if (name == "surface_z_mm") return surface_share * travel_mm(draft, "z");
  if (name == "clearance_mm") return std::min(clearance_mm, draft.number("surface_z_mm") / 2);
  if (name == "plate_x_mm") return travel_mm(draft, "x");
  if (name == "plate_y_mm") return plate_y();
  if (name == "fixed_y_mm") return draft.number("plate_y_mm") / 2;
  // docs/howto/real-bench.md: start with 6 N for recipes of 5 N.
  if (name == "force_cap_n") return is_real ? 6 : 11;
  double speed = 4;
  for (const std::string_view role : linear_roles)
    if (const DraftDevice* const device = draft.with_role(role))
      if (const apt::StageModel* const stage = apt::find_stage(device->stage))
        speed = std::min(speed, stage->max_speed);
  return speed;
}

}  // namespace

std::span<const NumberKey> number_keys() {
  return keys;
}

const DraftDevice* RigDraft::with_role(std::string_view role) const {
  const auto at = std::ranges::find(devices, role, &DraftDevice::role);
  return at == devices.end() ? nullptr : &*at;
}

bool RigDraft::needs(std::string_view number) const {
  if (number == "force_cap_n" || number == "torque_cap_nm") return has_wrench();
  if (number == "counts_per_newton" || number == "counts_per_newton_metre") {
    const DraftDevice* const wrench = with_role("wrench");
    return wrench != nullptr && wrench->found.kind == DeviceKind::net_ft && !wrench->found.http;
  }
  if (number == "taxel_cap_counts" || number == "press_depth_mm" || number == "touch_counts")
    return !has_wrench();
  if (number == "tilt_deg") return with_role("rx") != nullptr || with_role("ry") != nullptr;
  if (number.starts_with("fixed_")) {
    const std::string_view axis = number.substr(6, number.rfind('_') - 6);
    return with_role(axis) == nullptr;
  }
  return true;
}

double RigDraft::number(std::string_view key) const {
  const auto stated = answers.find(std::string(key));
  return stated == answers.end() ? default_number(*this, key) : stated->second;
}

bool can_share_role(const DraftDevice& a, const DraftDevice& b) {
  return a.found.kind == DeviceKind::taxel_array && b.found.kind == DeviceKind::taxel_array;
}

RigDraft draft_of(std::string name, BenchMode mode, std::vector<FoundDevice> found) {
  RigDraft draft;
  draft.name = std::move(name);
  draft.mode = mode;
  for (FoundDevice& device : found) {
    if (device.kind == DeviceKind::unknown) continue;
    DraftDevice& made = draft.devices.emplace_back();
    made.found = std::move(device);
    if (made.found.stages.size() == 1) made.stage = made.found.stages.front();
  }
  assign_roles(draft);
  return draft;
}

std::optional<apt::Axis> axis_of(const DraftDevice& device) {
  std::vector<std::string> stages = device.found.stages;
  if (!device.stage.empty()) stages = {device.stage};
  std::set<apt::Axis> axes;
  for (const std::string& stage : stages)
    if (const apt::StageModel* const model = apt::find_stage(stage)) axes.insert(model->axis);
  return axes.size() == 1 ? std::optional(*axes.begin()) : std::nullopt;
}

std::vector<std::string_view> possible_roles(const DraftDevice& device) {
  if (device.found.kind != DeviceKind::stage) return {sensor_role(device.found.kind), no_role};
  const auto axis = axis_of(device);
  std::vector<std::string_view> out;
  if (axis != apt::Axis::rotary) out.assign(linear_roles.begin(), linear_roles.end());
  if (axis != apt::Axis::linear) out.insert(out.end(), rotary_roles.begin(), rotary_roles.end());
  out.push_back(no_role);
  return out;
}

Status set_role(RigDraft& draft, std::string_view name, std::string_view role) {
  DraftDevice* const device = find_device(draft, name);
  if (device == nullptr && role == no_role && draft.left_out.contains(std::string(name))) return {};
  if (device == nullptr) return no_device(draft, name);
  const auto possible = possible_roles(*device);
  if (std::ranges::find(possible, role) == possible.end())
    return fail({.where = std::string(name),
                 .what = "device cannot have this role",
                 .expected = joined(possible),
                 .got = std::string(role)});
  device->role = role;
  device->is_role_stated = true;
  assign_roles(draft);
  return {};
}

Status set_stage(RigDraft& draft, std::string_view name, std::string_view stage) {
  DraftDevice* const device = find_device(draft, name);
  if (device == nullptr) return no_device(draft, name);
  if (std::ranges::find(device->found.stages, stage) == device->found.stages.end())
    return fail({.where = std::string(name),
                 .what = "unknown stage at this controller",
                 .expected = joined(device->found.stages),
                 .got = std::string(stage),
                 .hint = "See docs/reference/rig.md for stages and controllers"});
  device->stage = stage;
  assign_roles(draft);
  return {};
}

Status set_number(RigDraft& draft, std::string_view name, double value) {
  const auto* const key = std::ranges::find(keys, name, &NumberKey::name);
  if (key == std::end(keys)) {
    std::vector<std::string_view> names;
    for (const NumberKey& one : keys) names.push_back(one.name);
    return fail({.code = Errc::not_found,
                 .where = std::string(name),
                 .what = "unknown number of a rig",
                 .expected = joined(names)});
  }
  if (!(value >= key->low && value <= key->high))
    return fail({.code = Errc::range,
                 .where = std::string(name),
                 .what = "number out of range",
                 .expected = general(key->low) + " to " + general(key->high),
                 .got = general(value)});
  draft.answers[std::string(name)] = value;
  return {};
}

std::vector<const NumberKey*> unstated_numbers(const RigDraft& draft) {
  std::vector<const NumberKey*> out;
  for (const NumberKey& key : keys)
    if (draft.needs(key.name) && !draft.answers.contains(std::string(key.name)))
      out.push_back(&key);
  return out;
}

std::vector<const DraftDevice*> assumed_roles(const RigDraft& draft) {
  std::vector<const DraftDevice*> out;
  for (const DraftDevice& device : draft.devices)
    if (!device.is_role_stated && device.role != no_role) out.push_back(&device);
  return out;
}

}  // namespace weft::daemon
