#pragma once
// A device's part of a rig file: configuration, link and, where it is simulated, emulator.

#include <nlohmann/json_fwd.hpp>

#include "daemon/campaign/setup/rig_draft.hpp"

namespace weft::daemon {

/// Limits that follow the slowest stage.
struct StageLimits {
  double acceleration_mm_s2 = 20;
  double tilt_speed_deg_s = 5, tilt_acceleration_deg_s2 = 10;
};

/// Of a linear stage [mm]. On a real bench z ends a little below the plate: the stage's own travel
/// may go far through it.
std::array<double, 2> travel_of(const DraftDevice& device, const RigDraft& draft);
/// "ft", "taxels"; of stages see their roles.
std::string_view device_name(const DraftDevice& device);
std::string_view driver_name(DeviceKind kind);
/// What its driver takes. A stage's model is known.
nlohmann::ordered_json device_config(const DraftDevice& device, const RigDraft& draft,
                                     const StageLimits& limits);
nlohmann::ordered_json link_json(const LinkSettings& link);
/// What stands in for it on a simulated bench, and behind weft-rig's ports.
nlohmann::ordered_json emulator_json(const DraftDevice& device);

}  // namespace weft::daemon
