// Turns the reports of the devices into findings.

#include <cmath>
#include <map>

#include "daemon/base/text/format.hpp"
#include "daemon/campaign/diagnostics/doctor.hpp"
#include "protocols/base/names.hpp"

namespace weft::daemon {
namespace {

constexpr double rate_warning = 0.05;  // of the configured rate; allows for the start of a stream
constexpr double rate_problem = 0.20;
// A stage that is polled in every cycle of 10 ms answers well before the next but one.
constexpr double slow_answer_s = 0.020;

std::string format_identity(const DeviceIdentity& identity) {
  std::string out;
  for (const auto& [key, text] : identity.reported)
    out += (out.empty() ? "" : ", ") + key + " " + text;
  return out.empty() ? "no identity reported" : out;
}

std::string format_calibration(const DeviceIdentity& identity) {
  std::string out;
  for (const auto& [key, value] : identity.scale)
    out += (out.empty() ? "" : ", ") + key + " " + format_number(value);
  return out.empty() ? "raw counts" : out;
}

Diagnosis rate(const DeviceReport& device) {
  const double off = std::abs(device.rate_hz / device.configured_rate_hz - 1);
  const std::string what = fixed(device.rate_hz, 1) + " Hz measured, " +
                           fixed(device.configured_rate_hz, 1) + " Hz configured, longest gap " +
                           fixed(1000 * device.longest_gap_s, 0) + " ms";
  if (off <= rate_warning) return {Severity::ok, device.name, what, {}};
  return {off <= rate_problem ? Severity::warning : Severity::problem, device.name, what,
          "Correct rate_hz in the rig file or the setting of the device; check the link speed"};
}

Diagnosis latency(const DeviceReport& device) {
  const std::string what = "reply time " + fixed(1000 * device.latency_s, 1) + " ms (median of " +
                           std::to_string(device.samples) + "), " +
                           fixed(1000 * device.worst_latency_s, 1) + " ms at most";
  if (device.latency_s <= slow_answer_s) return {Severity::ok, device.name, what, {}};
  return {Severity::warning, device.name, what,
          "Check the latency timer of the USB chip, the hubs and the load of this computer"};
}

/// For devices that send blocks. Their driver has compared the readings' rates with the configured
/// ones.
Diagnosis blocks(const DeviceReport& device) {
  return {Severity::ok,
          device.name,
          fixed(device.rate_hz, 1) + " blocks/s measured, longest gap " +
              fixed(device.longest_gap_s * 1e3, 1) + " ms",
          {}};
}

void check_device(const DeviceReport& device, std::vector<Diagnosis>& out) {
  if (device.answered)
    out.push_back({Severity::ok,
                   device.name,
                   device.driver + (device.plugin.empty() ? "" : " (" + device.plugin + ")") +
                       " on " + device.link + ": " + format_identity(device.identity) +
                       "; scale: " + format_calibration(device.identity),
                   {}});
  if (device.error) return out.push_back(problem_of(device.name, *device.error));
  if (!device.armed) return;
  if (device.samples == 0)
    return out.push_back({Severity::problem, device.name, "armed, but sends nothing",
                          "Check the settings of the device"});
  if (device.role == "vibro")
    out.push_back(blocks(device));
  else
    out.push_back(device.configured_rate_hz > 0 ? rate(device) : latency(device));
  if (device.lost > 0)
    out.push_back({Severity::warning, device.name,
                   std::to_string(device.lost) + " of " +
                       std::to_string(device.lost + device.samples) + " frames lost",
                   "Check the cable, and the network for other traffic"});
}

/// If one device answers on two ports, the wiring differs from the rig file.
void check_serials(const std::vector<DeviceReport>& devices, std::vector<Diagnosis>& out) {
  std::map<std::string, std::string> owners;
  for (const DeviceReport& device : devices)
    for (const auto& [key, text] : device.identity.reported) {
      if (key != "serial") continue;
      const auto [owner, first] = owners.emplace(device.driver + " " + text, device.name);
      if (!first)
        out.push_back({Severity::problem, device.name,
                       "same serial number as " + owner->second + ": " + text,
                       "Remove one of the two entries from the rig file"});
    }
}

}  // namespace

Diagnosis problem_of(const std::string& subject, Error error, const std::string& hint) {
  const std::string own = std::exchange(error.hint, {});
  return {Severity::problem, subject, to_string(error), hint.empty() ? own : hint};
}

std::vector<Diagnosis> check_devices(const std::vector<DeviceReport>& devices) {
  std::vector<Diagnosis> out;
  for (const DeviceReport& device : devices) check_device(device, out);
  check_serials(devices, out);
  return out;
}

}  // namespace weft::daemon
