// A device's part of a rig file: configuration, link and, for a simulated device, emulator.

#include "daemon/campaign/setup/device_config.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocols/apt/stage_scale.hpp"

namespace weft::daemon {
namespace {

namespace apt = protocols::apt;
using Json = nlohmann::ordered_json;

/// Readings of a Digital F/T sensor are averaged to about this rate.
constexpr double digital_rate_hz = 500;
constexpr double usual_wrench_hz = 500, usual_taxel_hz = 37, usual_imprint_hz = 5;
/// Rows and columns in the middle of an imprint array.
constexpr std::size_t scanned_side = 32;

double rate_or(const FoundDevice& found, double usual) {
  return found.rate_hz > 0 ? found.rate_hz : usual;
}

int average_of(const FoundDevice& found) {
  return std::max(1, static_cast<int>(std::lround(rate_or(found, 0) / digital_rate_hz)));
}

std::uint32_t number_of(const std::string& serial) {
  return serial.empty() ? 0 : static_cast<std::uint32_t>(std::stoul(serial));
}

Json stage_config(const DraftDevice& device, const RigDraft& draft, const StageLimits& limits) {
  const apt::StageModel& stage = *apt::find_stage(device.stage);
  const apt::StageModel* const paired = apt::find_stage(device.stage, device.found.model);
  Json out{{"stage", device.stage}};
  if (paired != nullptr && !(paired->scale == stage.scale)) out["controller"] = device.found.model;
  if (!device.found.serial.empty()) out["serial"] = number_of(device.found.serial);
  if (device.found.destination != apt::address::usb_unit)
    out["destination"] = device.found.destination;
  if (stage.axis == apt::Axis::linear) {
    out["max_speed_mm_s"] = draft.number("speed_mm_s");
    out["travel_mm"] = travel_of(device, draft);
    return out;
  }
  const double tilt = draft.number("tilt_deg");
  out["max_speed_deg_s"] = limits.tilt_speed_deg_s;
  out["acceleration_deg_s2"] = limits.tilt_acceleration_deg_s2;
  out["travel_deg"] = {-tilt, tilt};
  return out;
}

Json netft_config(const FoundDevice& found, const RigDraft& draft) {
  Json out{{"rate_hz", rate_or(found, usual_wrench_hz)}};
  for (const char* const scale : {"counts_per_newton", "counts_per_newton_metre"})
    if (!found.http) out[scale] = draft.number(scale);
  if (found.http && !found.serial.empty()) out["calibration_serial"] = found.serial;
  return out;
}

Json digital_config(const FoundDevice& found) {
  const int average = average_of(found);
  Json out{{"rate_hz", rate_or(found, usual_wrench_hz) / average}, {"average", average}};
  if (!found.serial.empty()) out["calibration_serial"] = found.serial;
  return out;
}

Json taxel_config(const FoundDevice& found) {
  Json out;
  if (found.rows > 0)
    out = {{"rows", found.rows}, {"cols", found.cols}};
  else
    out["taxels"] = found.taxels;
  out["rate_hz"] = rate_or(found, usual_taxel_hz);
  return out;
}

Json imprint_config(const FoundDevice& found) {
  Json out{{"rows", std::min(scanned_side, found.rows)},
           {"cols", std::min(scanned_side, found.cols)},
           {"rate_hz", rate_or(found, usual_imprint_hz)}};
  if (!found.serial.empty()) out["serial"] = number_of(found.serial);
  return out;
}

Json vibro_config(const FoundDevice& found) {
  Json out{{"acceleration_rate_hz", found.rate_hz}, {"sound_rate_hz", found.sound_rate_hz}};
  if (!found.serial.empty()) out["serial"] = number_of(found.serial);
  return out;
}

struct LinkWriter {
  Json operator()(const MemoryPort&) const { return {{"kind", "memory"}}; }
  Json operator()(const TcpPort& p) const {
    return {{"kind", "tcp"}, {"host", p.end.host}, {"port", p.end.port}};
  }
  Json operator()(const UdpPort& p) const {
    return {{"kind", "udp"}, {"host", p.end.host}, {"port", p.end.port}};
  }
  Json operator()(const SerialSettings& s) const {
    Json out{{"kind", "serial"}, {"path", s.path}, {"baud", s.baud}};
    if (s.parity != Parity::none) out["parity"] = s.parity == Parity::even ? "even" : "odd";
    if (s.rts_cts) out["rts_cts"] = true;
    if (s.ftdi_start_up) out["ftdi_start_up"] = true;
    return out;
  }
};

/// An array with the number of taxels found, as square as possible.
Json emulated_taxels(const FoundDevice& found) {
  std::size_t rows = found.rows, cols = found.cols;
  for (std::size_t side = 1; rows * cols != found.taxels && side * side <= found.taxels; ++side)
    if (found.taxels % side == 0) rows = side;
  if (found.rows == 0) cols = found.taxels / std::max<std::size_t>(rows, 1);
  return {{"kind", "taxel"},
          {"rows", rows},
          {"cols", cols},
          {"rate_hz", rate_or(found, usual_taxel_hz)}};
}

Json emulated_stage(const DraftDevice& device) {
  Json out{{"kind", "apt_stage"}, {"stage", device.stage}};
  if (!device.found.model.empty()) out["model"] = device.found.model;
  if (!device.found.serial.empty()) out["serial"] = number_of(device.found.serial);
  return out;
}

}  // namespace

std::array<double, 2> travel_of(const DraftDevice& device, const RigDraft& draft) {
  constexpr double below_plate_mm = 5;
  const apt::StageModel& stage = *apt::find_stage(device.stage);
  const bool ends_at_plate = draft.mode == BenchMode::real && device.role == "z";
  const double end =
      ends_at_plate ? draft.number("surface_z_mm") + below_plate_mm : stage.travel_high;
  return {stage.travel_low, std::min(end, stage.travel_high)};
}

std::string_view device_name(const DraftDevice& device) {
  switch (device.found.kind) {
    case DeviceKind::net_ft:
    case DeviceKind::digital_ft:
      return "ft";
    case DeviceKind::taxel_array:
      return "taxels";
    case DeviceKind::imprint_array:
      return "imprint";
    default:
      return "vibro";
  }
}

std::string_view driver_name(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::net_ft:
      return "ati_netft";
    case DeviceKind::digital_ft:
      return "ati_digital";
    case DeviceKind::taxel_array:
      return "taxel_array";
    case DeviceKind::imprint_array:
      return "imprint_array";
    case DeviceKind::vibration_sensor:
      return "vibro";
    default:
      return "thorlabs_apt";
  }
}

Json device_config(const DraftDevice& device, const RigDraft& draft, const StageLimits& limits) {
  switch (device.found.kind) {
    case DeviceKind::net_ft:
      return netft_config(device.found, draft);
    case DeviceKind::digital_ft:
      return digital_config(device.found);
    case DeviceKind::taxel_array:
      return taxel_config(device.found);
    case DeviceKind::imprint_array:
      return imprint_config(device.found);
    case DeviceKind::vibration_sensor:
      return vibro_config(device.found);
    default:
      return stage_config(device, draft, limits);
  }
}

Json link_json(const LinkSettings& link) {
  return std::visit(LinkWriter{}, link);
}

Json emulator_json(const DraftDevice& device) {
  const FoundDevice& found = device.found;
  switch (found.kind) {
    case DeviceKind::net_ft:
      return {{"kind", "rdt"}, {"rate_hz", rate_or(found, usual_wrench_hz)}};
    case DeviceKind::digital_ft:
      return {{"kind", "ati_digital"}, {"rate_hz", rate_or(found, usual_wrench_hz)}};
    case DeviceKind::taxel_array:
      return emulated_taxels(found);
    case DeviceKind::imprint_array:
      return {{"kind", "imprint"}, {"rate_hz", rate_or(found, usual_imprint_hz)}};
    case DeviceKind::vibration_sensor:
      return {{"kind", "vibro"},
              {"acceleration_rate_hz", found.rate_hz},
              {"sound_rate_hz", found.sound_rate_hz}};
    default:
      return emulated_stage(device);
  }
}

}  // namespace weft::daemon
