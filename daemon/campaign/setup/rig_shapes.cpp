// Shapes of simulated rigs; declared in rig_writer.hpp.

#include <algorithm>

#include "daemon/base/text/format.hpp"
#include "daemon/campaign/setup/rig_writer.hpp"
#include "protocols/apt/stage_scale.hpp"

namespace weft::daemon {
namespace {

constexpr RigShape shapes[] = {
    {"5dof", "three linear and two rotary stages, a Net F/T force sensor, 16 taxels"},
    {"xyz", "three linear stages, a Net F/T force sensor, 16 taxels"},
    {"xz", "two linear stages, a Net F/T force sensor, 16 taxels"},
    {"digital", "as 5dof, with a Digital F/T force sensor"},
    {"taxels32", "as 5dof, with 4 x 8 taxels at 100 Hz"},
    {"two-arrays", "as xyz, with a second array of 6 taxels at 50 Hz"},
    {"no-force-sensor", "three linear stages and 16 taxels: presses by depth"},
};

/// A stage as its emulator reports it; serial numbers in one rig differ.
FoundDevice stage(const char* name, int number) {
  const auto& model = *protocols::apt::find_stage(name);
  FoundDevice out;
  out.kind = DeviceKind::stage;
  out.model = model.usual_controller;
  out.serial =
      std::to_string(protocols::apt::find_controller(model.usual_controller)->serial + number);
  out.stages = {name};
  return out;
}

FoundDevice sensor(DeviceKind kind, double rate_hz) {
  FoundDevice out;
  out.kind = kind;
  out.rate_hz = rate_hz;
  return out;
}

}  // namespace

std::span<const RigShape> rig_shapes() {
  return shapes;
}

Result<RigDraft> simulated_draft(std::string_view shape) {
  if (std::ranges::find(shapes, shape, &RigShape::name) == std::end(shapes)) {
    std::vector<std::string_view> names;
    for (const RigShape& one : shapes) names.push_back(one.name);
    return fail({.code = Errc::not_found,
                 .where = std::string(shape),
                 .what = "unknown rig shape",
                 .expected = joined(names)});
  }
  std::vector<FoundDevice> devices;
  for (int number = 0; number < (shape == "xz" ? 2 : 3); ++number)
    devices.push_back(stage("LTS150", number));
  if (shape == "5dof" || shape == "digital" || shape == "taxels32")
    for (int number = 0; number < 2; ++number) devices.push_back(stage("PRM1-Z8", number));
  if (shape != "no-force-sensor")
    devices.push_back(
        sensor(shape == "digital" ? DeviceKind::digital_ft : DeviceKind::net_ft, 100));
  const bool large = shape == "taxels32";
  devices.push_back(sensor(DeviceKind::taxel_array, large ? 100 : 37));
  devices.back().taxels = large ? 32 : 16;
  if (large) devices.back().rows = 4, devices.back().cols = 8;
  if (shape == "two-arrays") {
    devices.push_back(sensor(DeviceKind::taxel_array, 50));
    devices.back().taxels = 6;
  }
  RigDraft draft =
      draft_of("simulated-" + std::string(shape), BenchMode::simulated, std::move(devices));
  for (DraftDevice& device : draft.devices) device.is_role_stated = true;  // by the shape
  return draft;
}

}  // namespace weft::daemon
