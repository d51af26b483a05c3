#pragma once
// What the web pages of a Net F/T box set: the forms, keys and limits that a public client has from
// the box's manual (9620-05-NET FT-22, 7.1 to 7.4) and has tried on a box of firmware 2.2.59.

#include <array>
#include <cstdint>
#include <string_view>

#include "protocols/rdt/page.hpp"
#include "sim/devices/ft_sensor.hpp"

namespace weft::sim {

/// The new origin lies `offset_m` from the sensor's, along the sensor's axes; the frame is then
/// turned about its own x, then its y, then its z axis. This order is from memory.
class ToolTransform {
 public:
  ToolTransform() = default;
  /// Errors: unsupported, for a unit that the box does not have.
  static Result<ToolTransform> create(const protocols::rdt::Configuration& of);

  [[nodiscard]] bool none() const { return *this == ToolTransform{}; }
  [[nodiscard]] Wrench apply(const Wrench& sensed) const;

  bool operator==(const ToolTransform&) const = default;

 private:
  std::array<double, 3> offset_m_{};
  std::array<double, 3> turn_rad_{};
};

/// A box sends every n-th of so many conversions a second.
inline constexpr double conversions_hz = 7000;

struct NetftSettings {
  double rate_hz = 100;                          ///< of the next stream, 1 to 7000
  std::size_t records_per_datagram = 10;         ///< of buffered streams, 1 to 40
  bool rdt_enabled = true;                       ///< without, no start request is heard
  bool ethernet_ip = false, multi_unit = false;  ///< shown only [E]
  unsigned user_filter = 0;  ///< the low-pass filter's number; readings are not filtered [E]
  bool peak_logging = false;
  std::array<std::int32_t, 6> bias_counts{};  ///< of force and torque; a box has its gauges' [E]
  std::array<protocols::rdt::Configuration, protocols::rdt::configurations> configuration;
  unsigned active = 0;  ///< which configuration
  bool thresholds_enabled = false;
  std::array<protocols::rdt::Threshold, protocols::rdt::thresholds> threshold;
};

/// Of /comm.cgi: comrdtrate, rounded up to the next rate that the box has; comrdtbsiz, comrdte,
/// comrdtmsyn, comeipe. Here and below, a value outside what the box takes leaves the old one.
void apply_communication(NetftSettings& settings, std::string_view query);
/// Of /setting.cgi: setuserfilter, setpke, setcfgsel, setbias0 to setbias5.
void apply_settings(NetftSettings& settings, std::string_view query);
/// Of /config.cgi: cfgnam, cfgcalsel, cfgfu, cfgtu, cfgtdu, cfgtau, cfgtfx0 to cfgtfx5, cfgusra,
/// cfgusrb, of the configuration cfgid, without which nothing is taken.
void apply_configuration(NetftSettings& settings, std::string_view query);
/// Of /moncon.cgi: setmce, and mce, mcx, mcc, mcv, mco of each threshold.
void apply_thresholds(NetftSettings& settings, std::string_view query);

}  // namespace weft::sim
