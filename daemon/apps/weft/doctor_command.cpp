#include <nlohmann/json.hpp>

#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/campaign/diagnostics/doctor.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct DoctorArgs {
  std::filesystem::path rig;
  std::filesystem::path out = ".";
  double listen_s = 2;
  PluginArgs plugins;
};

std::string_view bench_mode_text(BenchMode mode) {
  if (mode == BenchMode::simulated) return "simulated";
  return mode == BenchMode::emulated ? "emulated" : "real";
}

std::string bench_sentence(const DoctorReport& report) {
  if (report.mode == BenchMode::simulated)
    return "SIMULATED bench " + report.rig_name + ": emulators in this process, virtual time.\n";
  if (report.mode == BenchMode::emulated)
    return "EMULATED bench " + report.rig_name + ": simulated devices behind real ports.\n";
  return "Bench " + report.rig_name + ".\n";
}

std::string usb_id(const SerialPortSeen& port) {
  if (port.usb_vendor < 0) return "not on USB";
  char text[16];
  std::snprintf(text, sizeof text, "%04x:%04x", static_cast<unsigned>(port.usb_vendor),
                static_cast<unsigned>(port.usb_product));
  return text;
}

std::string ports_text(const std::vector<SerialPortSeen>& ports) {
  if (ports.empty()) return "Serial ports of this machine: none\n";
  Table table(Align::left);
  for (const SerialPortSeen& port : ports)
    table.row({port.name, usb_id(port), port.usb_serial, port.note, port.description});
  return "Serial ports of this machine:\n" + table.text();
}

std::string count_text(const DoctorReport& report) {
  const auto number = [](std::size_t n, const std::string& word) {
    return (n == 0 ? "no" : std::to_string(n)) + " " + word + (n == 1 ? "" : "s");
  };
  return number(report.count(Severity::problem), "problem") + ", " +
         number(report.count(Severity::warning), "warning") + "\n";
}

std::string format_text(const DoctorReport& report) {
  Table table(Align::left);
  for (const Diagnosis& diagnosis : report.found_problems) {
    table.row({std::string(to_string(diagnosis.severity)), diagnosis.subject, diagnosis.what});
    if (!diagnosis.hint.empty()) table.row({"", "", "-> " + diagnosis.hint});
  }
  return bench_sentence(report) + table.text() + ports_text(report.ports) + count_text(report);
}

json device_json(const DeviceReport& d) {
  json reported = json::object();
  json scale = json::object();
  for (const auto& [key, text] : d.identity.reported) reported[key] = text;
  for (const auto& [key, value] : d.identity.scale) scale[key] = value;
  json out{{"name", d.name},       {"role", d.role},         {"driver", d.driver},
           {"link", d.link},       {"answered", d.answered}, {"armed", d.armed},
           {"reported", reported}, {"scale", scale},         {"samples", d.samples},
           {"frames_lost", d.lost}};
  out["plugin"] = d.plugin.empty() ? json(nullptr) : json(d.plugin);
  out["error"] = d.error ? error_json(*d.error) : json(nullptr);
  if (d.configured_rate_hz > 0) out["configured_rate_hz"] = d.configured_rate_hz;
  if (d.configured_rate_hz > 0 || d.role == "vibro") {
    out["rate_hz"] = d.rate_hz;
    out["longest_gap_s"] = d.longest_gap_s;
  } else if (d.samples > 0) {
    out["latency_s"] = d.latency_s;
    out["worst_latency_s"] = d.worst_latency_s;
  }
  return out;
}

json port_json(const SerialPortSeen& port) {
  json out{{"name", port.name}, {"description", port.description}, {"note", port.note}};
  out["usb"] =
      port.usb_vendor < 0 ? json(nullptr) : json{{"id", usb_id(port)}, {"serial", port.usb_serial}};
  return out;
}

json json_of(const DoctorReport& report) {
  json out{{"command", "doctor"},
           {"rig", report.rig_name},
           {"bench", bench_mode_text(report.mode)},
           {"problems", report.count(Severity::problem)},
           {"warnings", report.count(Severity::warning)}};
  out["devices"] = json::array();
  for (const DeviceReport& device : report.devices) out["devices"].push_back(device_json(device));
  out["findings"] = json::array();
  for (const Diagnosis& f : report.found_problems)
    out["findings"].push_back({{"severity", to_string(f.severity)},
                               {"subject", f.subject},
                               {"what", f.what},
                               {"hint", f.hint}});
  out["serial_ports"] = json::array();
  for (const SerialPortSeen& port : report.ports) out["serial_ports"].push_back(port_json(port));
  return out;
}

void add_options(CLI::App& command, DoctorArgs& args) {
  command.add_option("--rig", args.rig, "use this rig file (JSON)")->required();
  command
      .add_option("--out", args.out,
                  "check free space in this folder, where campaigns are recorded")
      ->capture_default_str();
  add_number(command, "--listen", args.listen_s, 0.1, 600.0,
             "read the devices for this number of seconds");
  add_options(command, args.plugins);
}

/// Returns exit_failure if there is a problem; warnings alone do not count.
Result<int> run_doctor(const DoctorArgs& args, Console& console) {
  const Result<DoctorReport> report =
      examine({args.rig, args.out, args.listen_s, make_settings(args.plugins, console)});
  if (!report) return pass(report.error());
  print(console, format_text(*report), json_of(*report));
  return report->count(Severity::problem) == 0 ? exit_ok : exit_failure;
}

}  // namespace

void add_doctor_command(const CommandGroup& weft) {
  weft.add<DoctorArgs>("doctor", run_doctor);
}

}  // namespace weft::daemon::cli
