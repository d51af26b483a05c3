#pragma once
// A rig file before it is written: the role of each found device, and the numbers that no device
// reports. Values, without a port or a file.

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "daemon/campaign/setup/found_device.hpp"
#include "protocols/apt/stage_scale.hpp"

namespace weft::daemon {

inline constexpr std::string_view no_role = "none";

struct DraftDevice {
  FoundDevice found;
  std::string role{no_role};  ///< "x" ... "vibro", or no_role: not in the rig file
  std::string stage;          ///< of a stage: "LTS150"; empty if unknown
  bool is_role_stated = false;
};

/// A number of the rig file. Its default, and whether it is needed, depend on the devices.
struct NumberKey {
  std::string_view name;      ///< "surface_z_mm", in options, answers and output
  std::string_view question;  ///< text for a person
  double low, high;
  /// No default on a real bench, because a wrong value does harm.
  bool is_measured = false;
};
std::span<const NumberKey> number_keys();

struct RigDraft {
  std::string name;
  BenchMode mode = BenchMode::real;
  Endpoint console;  ///< emulated: where weft-rig accepts orders
  std::vector<DraftDevice> devices;
  std::map<std::string, double> answers;  ///< stated numbers, by name
  std::set<std::string> left_out;         ///< devices without role that were not even opened

  [[nodiscard]] const DraftDevice* with_role(std::string_view role) const;
  [[nodiscard]] bool has_wrench() const { return with_role("wrench") != nullptr; }
  /// Whether the rig file has this number.
  [[nodiscard]] bool needs(std::string_view number) const;
  [[nodiscard]] bool has_default(const NumberKey& number) const {
    return mode != BenchMode::real || !number.is_measured;
  }
  /// The stated number, or its default.
  [[nodiscard]] double number(std::string_view key) const;
};

/// Whether one role could go to either device.
bool can_share_role(const DraftDevice& a, const DraftDevice& b);

/// Assigns roles by kind and serial number: linear stages x, y, z (two: x and z; one: z), rotary
/// stages rx and ry, every taxel array, and one sensor of each other kind. The rest has no role. On
/// a real bench, a Net F/T box that was not named has no role either: it may serve another
/// computer.
RigDraft draft_of(std::string name, BenchMode mode, std::vector<FoundDevice> found);

/// `device`: its place, its port's name in the rig file, or its serial number. Assigns the roles
/// that were not stated again. Errors: not_found; invalid_argument for a role that it cannot have,
/// or a stage that its controller cannot have.
Status set_role(RigDraft& draft, std::string_view device, std::string_view role);
Status set_stage(RigDraft& draft, std::string_view device, std::string_view stage);
/// Errors: not_found (no such number), range.
Status set_number(RigDraft& draft, std::string_view name, double value);

/// Devices with the role "none" in `answers_json`; empty if it is not valid.
std::vector<std::string> devices_without_role(std::string_view answers_json);

/// Applies `answers_json`: {"roles": {DEVICE: ROLE}, "stages": {DEVICE: STAGE}, NUMBER: value}.
/// Errors: parse, and those of the setters with a JSON pointer.
Status apply_answers(RigDraft& draft, std::string_view answers_json);

/// Checks answers before any device is known. Errors: as above.
Status check_answers(std::string_view answers_json);
/// A role, or no_role. Errors: invalid_argument.
Status check_role_name(std::string_view role);

/// Reasons why the draft is not a rig: an axis without a stage, no sensor that detects a touch, a
/// duplicate role, a controller with an unknown stage. On a real bench also a role that another
/// device could have, and a missing number without default. Each with what to do.
std::vector<Error> missing_parts(const RigDraft& draft);

/// The numbers that were not stated: the rig file has their defaults, if there are any.
std::vector<const NumberKey*> unstated_numbers(const RigDraft& draft);
/// The devices with a role that was not stated.
std::vector<const DraftDevice*> assumed_roles(const RigDraft& draft);

/// The axis of a stage: from the stated model, or from all that its controller may have.
std::optional<protocols::apt::Axis> axis_of(const DraftDevice& device);
/// The roles that a device of this kind can have.
std::vector<std::string_view> possible_roles(const DraftDevice& device);

}  // namespace weft::daemon
