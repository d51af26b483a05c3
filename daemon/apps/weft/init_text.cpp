#include "daemon/apps/weft/init_text.hpp"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/base/text/format.hpp"
#include "daemon/campaign/diagnostics/doctor.hpp"
#include "daemon/campaign/setup/rig_writer.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

std::string rate_text(const FoundDevice& found) {
  if (found.rate_hz <= 0) return {};
  std::string out = general(found.rate_hz) + " Hz";
  if (found.sound_rate_hz > 0) out += ", sound " + general(found.sound_rate_hz) + " Hz";
  return out;
}

/// Description of a device beside model and serial number.
std::string details(const FoundDevice& found) {
  if (found.kind == DeviceKind::stage)
    return found.stages.empty() ? "unknown stage" : joined(found.stages);
  std::string out = rate_text(found);
  if (found.taxels > 0) out = std::to_string(found.taxels) + " taxels, " + out;
  if (found.kind == DeviceKind::imprint_array)
    out = std::to_string(found.rows) + " x " + std::to_string(found.cols) + " taxels, " + out;
  return out;
}

json found_json(const FoundDevice& found) {
  json out{
      {"place", found.place},   {"kind", to_string(found.kind)}, {"model", found.model},
      {"serial", found.serial}, {"rate_hz", found.rate_hz},      {"stages", found.stages},
      {"taxels", found.taxels}, {"notes", found.notes},          {"link", link_text(found.link)}};
  out["problem"] = found.problem ? error_json(*found.problem) : json(nullptr);
  return out;
}

json devices_json(const SearchReport& report) {
  json out = json::array();
  for (const FoundDevice& found : report.devices) out.push_back(found_json(found));
  return out;
}

/// Quoted for a shell.
std::string quoted(const std::string& text) {
  const bool is_plain = std::ranges::all_of(text, [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("/._-+:").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (is_plain) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::vector<std::string> next_commands(const std::filesystem::path& rig, const std::string& recipe,
                                       const RigDraft& draft) {
  const std::string file = quoted(rig.string());
  std::vector<std::string> out{"weft doctor --rig " + file};
  if (recipe.empty()) return out;
  out.push_back("weft check " + recipe + " --rig " + file);
  if (draft.mode != BenchMode::real)
    out.push_back("weft run " + recipe + " --rig " + file + " --out " +
                  quoted("out/" + draft.name));
  return out;
}

/// Remaining tasks of a person on a bench of their own.
std::vector<std::string> things_to_do(const std::string& recipe, const RigDraft& draft) {
  std::vector<std::string> out;
  if (recipe.empty())
    out.emplace_back("write a recipe: no library recipe fits this rig; see recipes/README.md");
  if (draft.mode == BenchMode::real) {
    out.emplace_back(
        "measure the assumed numbers and probe.slack_mm; see docs/howto/real-bench.md");
    if (draft.has_wrench())
      out.emplace_back("check that pushing the plate down gives +Fz; if not, set sign_z to -1");
    if (const DraftDevice* const wrench = draft.with_role("wrench");
        wrench != nullptr && wrench->found.kind == DeviceKind::net_ft)
      out.emplace_back(
          "set rated_force_n of the force sensor: the default of 40, 40, 120 N is that of a "
          "Mini40");
  }
  for (const DraftDevice& device : draft.devices) {
    if (device.role != no_role)
      for (const std::string& note : device.found.notes)
        out.push_back(device.found.place + ": " + note);
    const bool has_unknown_rate = device.role != no_role &&
                                  device.found.kind != DeviceKind::stage &&
                                  device.found.rate_hz <= 0;
    if (has_unknown_rate)
      out.push_back(device.found.place + ": set its rate_hz; the device did not report it");
  }
  return out;
}

/// The port's name in the rig file, if it differs from the name at which it was found.
std::string stable_name(const FoundDevice& found) {
  const auto* port = std::get_if<SerialSettings>(&found.link);
  return port == nullptr || port->path == found.place ? std::string() : "as " + port->path;
}

/// Guessed roles and default numbers; empty if there are none.
std::string assumed_text(const RigDraft& draft) {
  Table table(Align::left);
  const auto roles = assumed_roles(draft);
  for (const DraftDevice* const device : roles)
    table.row({"role " + device->role, format_device(device->found),
               device->found.kind == DeviceKind::stage ? "from the serial number"
                                                       : "from the device type"});
  const auto numbers = unstated_numbers(draft);
  for (const NumberKey* const key : numbers)
    table.row(
        {std::string(key->name), general(draft.number(key->name)), std::string(key->question)});
  if (roles.empty() && numbers.empty()) return {};
  return "Assumed values, reported by no device (change them with --role and --set, or in the "
         "file):\n" +
         table.text();
}

}  // namespace

std::string format_device(const FoundDevice& found) {
  std::string out = found.model.empty() ? std::string(to_string(found.kind)) : found.model;
  if (!found.serial.empty()) out += " " + found.serial;
  return found.place.empty() ? out : out + " at " + found.place;
}

std::string sentence_case(std::string_view text) {
  std::string out(text);
  if (!out.empty())
    out.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(out.front())));
  return out;
}

std::string format_found(const SearchReport& report) {
  if (report.devices.empty() && report.warnings.empty()) return "No device was found.\n";
  Table table(Align::left);
  std::string remarks;
  for (const FoundDevice& found : report.devices) {
    table.row({found.place, std::string(to_string(found.kind)), found.model, found.serial,
               found.problem ? std::string() : details(found)});
    if (found.problem) remarks += "warning: " + to_string(*found.problem) + "\n";
    for (const std::string& note : found.notes)
      remarks += "note: " + found.place + ": " + note + "\n";
  }
  for (const std::string& warning : report.warnings) remarks += "warning: " + warning + "\n";
  return (report.devices.empty() ? "No device was found.\n" : "Found:\n" + table.text()) + remarks;
}

std::string format_init(const std::filesystem::path& rig, const std::string& recipe,
                        const RigDraft& draft) {
  Table table(Align::left);
  for (const DraftDevice& device : draft.devices)
    table.row({device.role == no_role ? "left out" : device.role, device.stage,
               format_device(device.found), stable_name(device.found)});
  std::string out = "Wrote " + rig.string() + ":\n" + table.text() + assumed_text(draft);
  if (const auto to_do = things_to_do(recipe, draft); !to_do.empty()) {
    out += "To do:\n";
    for (const std::string& thing : to_do) out += "  " + thing + "\n";
  }
  out += "Next:\n";
  for (const std::string& command : next_commands(rig, recipe, draft)) out += "  " + command + "\n";
  return out;
}

json init_json(const std::filesystem::path& rig, const std::string& recipe, const RigDraft& draft,
               const SearchReport& report) {
  json out{{"command", "init"},
           {"rig", rig.string()},
           {"found", devices_json(report)},
           {"warnings", report.warnings},
           {"to_do", things_to_do(recipe, draft)},
           {"recipe", recipe.empty() ? json(nullptr) : json(recipe)},
           {"next", next_commands(rig, recipe, draft)}};
  out["roles"] = json::object();
  for (const DraftDevice& device : draft.devices)
    if (device.role != no_role)
      out["roles"][device.role] = {
          {"place", device.found.place}, {"serial", device.found.serial}, {"stage", device.stage}};
  out["assumed"] = json::object();
  for (const DraftDevice* const device : assumed_roles(draft))
    out["assumed"]["roles"][device->found.place] = device->role;
  for (const NumberKey* const key : unstated_numbers(draft))
    out["assumed"][std::string(key->name)] = draft.number(key->name);
  return out;
}

int refuse_draft(const std::vector<Error>& missing, const SearchReport& report, Console& console) {
  json problems = json::array();
  for (const Error& error : missing) {
    console.err << "weft: " << to_string(error) << '\n';
    problems.push_back(error_json(error));
  }
  console.err << "weft: no rig file was written\n";
  if (console.json) {
    json error = problems.front();
    error["problems"] = problems;
    error["found"] = devices_json(report);
    console.out << json{{"error", error}}.dump(2, ' ', false, json::error_handler_t::replace)
                << '\n';
  }
  return exit_failure;
}

}  // namespace weft::daemon::cli
