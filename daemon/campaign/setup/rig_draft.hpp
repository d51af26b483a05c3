#pragma once
// A rig file before it is written: which found device has which role, and the numbers that no
// device reports. Values, without a port or a file.

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
  std::string role{no_role};  ///< "x" ... "vibro", or no_role: the rig file leaves it out
  std::string stage;          ///< of a stage: "LTS150"; empty where it is not known
  bool is_role_stated = false;
};

/// A number of the rig file. Default and whether it is needed follow the devices.
struct NumberKey {
  std::string_view name;      ///< "surface_z_mm", of options, answers and output
  std::string_view question;  ///< what a person is asked
  double low, high;
  /// On a real bench it has no default, for a wrong one does harm.
  bool is_measured = false;
};
std::span<const NumberKey> number_keys();

struct RigDraft {
  std::string name;
  BenchMode mode = BenchMode::real;
  Endpoint console;  ///< emulated: where weft-rig takes orders
  std::vector<DraftDevice> devices;
  std::map<std::string, double> answers;  ///< numbers that were stated, by their names
  std::set<std::string> left_out;         ///< devices of no role that were not even asked

  [[nodiscard]] const DraftDevice* with_role(std::string_view role) const;
  [[nodiscard]] bool has_wrench() const { return with_role("wrench") != nullptr; }
  /// Whether the rig file has this number.
  [[nodiscard]] bool needs(std::string_view number) const;
  [[nodiscard]] bool has_default(const NumberKey& number) const {
    return mode != BenchMode::real || !number.is_measured;
  }
  /// As it was stated; else its default.
  [[nodiscard]] double number(std::string_view key) const;
};

/// Whether a rig may give one role to both.
bool can_share_role(const DraftDevice& a, const DraftDevice& b);

/// Roles by kind and serial number: linear stages x, y, z (two: x and z; one: z), rotary ones rx
/// and ry, every array of taxels, of the other sensors one of each kind. The rest has none; so has,
/// on a real bench, a Net F/T box that nobody named, which may serve another computer.
RigDraft draft_of(std::string name, BenchMode mode, std::vector<FoundDevice> found);

/// `device`: its place, its port's name in the rig file, or its serial number. Roles that were not
/// stated are given again, to what is left. Errors: not_found; invalid_argument, for a role that
/// it cannot have, or a stage that its controller cannot have.
Status set_role(RigDraft& draft, std::string_view device, std::string_view role);
Status set_stage(RigDraft& draft, std::string_view device, std::string_view stage);
/// Errors: not_found (no such number), range.
Status set_number(RigDraft& draft, std::string_view name, double value);

/// Devices that `answers_json` gives the role "none"; empty where it is no such text.
std::vector<std::string> devices_without_role(std::string_view answers_json);

/// What `answers_json` states: {"roles": {DEVICE: ROLE}, "stages": {DEVICE: STAGE}, NUMBER: value}.
/// Errors: parse, and those of the setters with a JSON pointer.
Status apply_answers(RigDraft& draft, std::string_view answers_json);

/// What can be wrong with answers before any device is known. Errors: as above.
Status check_answers(std::string_view answers_json);
/// A role, or no_role. Errors: invalid_argument.
Status check_role_name(std::string_view role);

/// What keeps the draft from being a rig: an axis without a stage, no sensor that feels a touch, a
/// role twice, a controller whose stage is not known; on a real bench a role that another device
/// could have as well, and a number that has no default. Each with what to do.
std::vector<Error> missing_parts(const RigDraft& draft);

/// The numbers that were not stated: the rig file has them by default, where they have one.
std::vector<const NumberKey*> unstated_numbers(const RigDraft& draft);
/// The devices whose role was not stated, but for those without one.
std::vector<const DraftDevice*> assumed_roles(const RigDraft& draft);

/// The axis of a stage: of that which is stated, or of all that its controller may have.
std::optional<protocols::apt::Axis> axis_of(const DraftDevice& device);
/// The roles that a device of this kind can have.
std::vector<std::string_view> possible_roles(const DraftDevice& device);

}  // namespace weft::daemon
