#pragma once
// A device's part of a rig file: configuration, link and, for a simulated device, emulator.

#include <nlohmann/json_fwd.hpp>

#include "daemon/campaign/setup/rig_draft.hpp"

namespace weft::daemon {

/// Limits of the slowest stage.
struct StageLimits {
  double acceleration_mm_s2 = 20;
  double tilt_speed_deg_s = 5, tilt_acceleration_deg_s2 = 10;
};

/// Travel of a linear stage [mm]. On a real bench z ends a little below the plate: the stage's own
/// travel may go far through it.
std::array<double, 2> travel_of(const DraftDevice& device, const RigDraft& draft);
/// "ft", "taxels"; a stage is named by its role.
std::string_view device_name(const DraftDevice& device);
std::string_view driver_name(DeviceKind kind);
/// Configuration for the device's driver. Requires a known model of a stage.
nlohmann::ordered_json device_config(const DraftDevice& device, const RigDraft& draft,
                                     const StageLimits& limits);
nlohmann::ordered_json link_json(const LinkSettings& link);
/// Emulator of the device, for a simulated bench and behind weft-rig's ports.
nlohmann::ordered_json emulator_json(const DraftDevice& device);

}  // namespace weft::daemon
