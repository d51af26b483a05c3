// Applies answers to a draft and finds its missing parts; declared in rig_draft.hpp.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/base/text/format.hpp"
#include "daemon/campaign/setup/rig_draft.hpp"
#include "daemon/hardware/rig/roles.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

/// Passes each entry of {DEVICE: text} to `set`. Stages come before roles, which depend on them.
Status apply_texts(RigDraft& draft, const json& answers, const char* key,
                   Status (*set)(RigDraft&, std::string_view, std::string_view)) {
  if (!answers.contains(key)) return {};
  const std::string where = child("", key);
  if (!answers[key].is_object())
    return fail({.where = where, .what = "not an object", .expected = "{DEVICE: text}"});
  for (const auto& [device, text] : answers[key].items()) {
    if (!text.is_string())
      return fail({.where = child(where, device), .what = "not a string", .got = text.dump()});
    if (Status done = set(draft, device, text.get<std::string>()); !done)
      return pass(done.error(), where);
  }
  return {};
}

/// Error for an unknown stage, for an impossible role, or for a role that another device could also
/// have.
std::optional<Error> open_question(const RigDraft& draft, const DraftDevice& device) {
  const std::string& place = device.found.place;
  const bool is_left_out = device.role == no_role;
  if (device.found.kind != DeviceKind::stage || (is_left_out && device.is_role_stated)) return {};
  if (device.stage.empty())
    return Error{.code = Errc::not_found,
                 .where = place,
                 .what = "unknown stage at this " + device.found.model,
                 .expected = device.found.stages.empty() ? "a controller in docs/reference/rig.md"
                                                         : joined(device.found.stages),
                 .hint =
                     "State it with --stage PORT=STAGE, or exclude it with --role PORT=none (see "
                     "docs/reference/rig.md)"};
  const auto possible = possible_roles(device);
  if (std::ranges::find(possible, device.role) == possible.end())
    return Error{.where = place,
                 .what = device.stage + " cannot have this role",
                 .expected = joined(possible),
                 .got = device.role};
  if (draft.mode != BenchMode::real || device.is_role_stated) return {};
  return Error{.code = Errc::not_found,
               .where = place,
               .what = "role of this stage (" + device.stage + " " + device.found.serial +
                       ") not stated for a real bench",
               .expected = joined(possible),
               .hint = "State it at a terminal, in an answers file or with --role " + place +
                       "=ROLE (by serial number: " + device.role + ")"};
}

Error unmeasured(const NumberKey& key) {
  return {.code = Errc::not_found,
          .where = std::string(key.name),
          .what = "number for a real bench missing, " + std::string(key.question),
          .expected = general(key.low) + " to " + general(key.high),
          .hint = "Measure it, then state it at a terminal, in an answers file or with --set " +
                  std::string(key.name) + "=NUMBER"};
}

Error missing(std::string what, std::string hint) {
  return {.code = Errc::not_found, .what = std::move(what), .hint = std::move(hint)};
}

}  // namespace

std::vector<std::string> devices_without_role(std::string_view answers_json) {
  std::vector<std::string> out;
  const auto answers = parse_json(answers_json);
  if (!answers || !answers->is_object() || !answers->contains("roles")) return out;
  for (const auto& [device, role] : (*answers)["roles"].items())
    if (role == no_role) out.push_back(device);
  return out;
}

Status check_role_name(std::string_view role) {
  if (role == no_role || is_role(role)) return {};
  return fail({.what = "unknown role",
               .expected = std::string(all_roles) + "; or " + std::string(no_role),
               .got = std::string(role)});
}

Status check_answers(std::string_view answers_json) {
  const auto answers = parse_json(answers_json);
  if (!answers) return pass(answers.error());
  RigDraft scratch;
  json numbers = *answers;
  if (numbers.is_object()) numbers.erase("roles"), numbers.erase("stages");
  if (Status done = apply_answers(scratch, numbers.dump()); !done) return done;
  const json roles = answers->value("roles", json::object());
  if (!roles.is_object()) return {};  // apply_answers() reports the place
  for (const auto& [device, role] : roles.items())
    if (role.is_string())
      if (Status known = check_role_name(role.get<std::string>()); !known)
        return pass(known.error(), child("/roles", device));
  return {};
}

Status apply_answers(RigDraft& draft, std::string_view answers_json) {
  const auto answers = parse_json(answers_json);
  if (!answers) return pass(answers.error());
  if (!answers->is_object())
    return fail({.code = Errc::parse, .what = "invalid answers file", .expected = "a JSON object"});
  if (Status stages = apply_texts(draft, *answers, "stages", set_stage); !stages) return stages;
  if (Status roles = apply_texts(draft, *answers, "roles", set_role); !roles) return roles;
  for (const auto& [key, value] : answers->items()) {
    if (key == "stages" || key == "roles") continue;
    if (!value.is_number())
      return fail({.where = child("", key), .what = "not a number", .got = value.dump()});
    if (Status done = set_number(draft, key, value.get<double>()); !done) return done;
  }
  return {};
}

std::vector<Error> missing_parts(const RigDraft& draft) {
  std::vector<Error> out;
  for (const char* const role : {"x", "z"})
    if (draft.with_role(role) == nullptr)
      out.push_back(missing(std::string("stage missing for the required role ") + role,
                            "Connect it and switch it on, name its port with --port, or assign the "
                            "role with --role PORT=" +
                                std::string(role)));
  if (!draft.has_wrench() && draft.with_role("taxels") == nullptr)
    out.push_back(missing("force sensor or taxel array missing",
                          "Connect one, name a Net F/T box with --netft HOST, or a port with "
                          "--port PORT"));
  for (const DraftDevice& device : draft.devices) {
    if (device.role == no_role) continue;
    const auto is_rival = [&](const DraftDevice& other) {
      return &other != &device && other.role == device.role && !can_share_role(device, other);
    };
    if (std::ranges::any_of(draft.devices, is_rival))
      out.push_back({.where = device.found.place,
                     .what = "several devices with role " + device.role,
                     .hint = "Exclude one with --role PORT=none"});
  }
  for (const DraftDevice& device : draft.devices)
    if (const auto open = open_question(draft, device)) out.push_back(*open);
  for (const NumberKey* const key : unstated_numbers(draft))
    if (!draft.has_default(*key)) out.push_back(unmeasured(*key));
  return out;
}

}  // namespace weft::daemon
