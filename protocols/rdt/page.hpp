#pragma once
// The settings page of a Net F/T box, `GET /netftapi2.xml` on its HTTP port, and its calibration
// page /netftcalapi.xml (device-facts.md, Net F/T pages). Text in, text out; no I/O.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/rdt/http.hpp"

namespace weft::protocols::rdt {

inline constexpr std::string_view settings_path = "/netftapi2.xml";
inline constexpr std::string_view calibration_path = "/netftcalapi.xml";

inline constexpr std::size_t configurations = 16, thresholds = 16;

/// One configuration of a box, as set by /config.cgi. Unit codes are those of WriteTransform,
/// force_unit_name() and torque_unit_name().
struct Configuration {
  std::string name = "Weft";
  unsigned calibration = 0;
  unsigned force_unit = 2, torque_unit = 3, distance_unit = 3, angle_unit = 1;
  std::array<double, 6> tool_transform{};  ///< dx dy dz rx ry rz, in those units
  std::string user_a, user_b;
};

/// One threshold statement of a box, as set by /moncon.cgi.
struct Threshold {
  bool enabled = false;
  int axis = -1;             ///< 0 Fx to 5 Tz; -1: none
  int comparison = 1;        ///< 1: above the value, -1: below
  std::int32_t counts = 0;   ///< the value
  unsigned output_code = 0;  ///< 0 to 255
};

/// The tags that clients use. Lists of six are Fx Fy Fz Tx Ty Tz.
struct SettingsPage {
  std::string product = "Net F/T";  ///< prodname; empty if the box has none
  double counts_per_force = 1e6;    ///< cfgcpf
  double counts_per_torque = 1e6;   ///< cfgcpt
  std::string force_unit = "N";     ///< scfgfu
  std::string torque_unit = "Nm";   ///< scfgtu: Nm with firmware 2.2.59, else N-m
  bool rdt_enabled = true;          ///< comrdte
  double rdt_rate_hz = 0;           ///< comrdtrate
  std::string calibration_serial;   ///< cfgcalsn; empty if the box has none
  // Written only.
  unsigned user_filter = 0;                                       ///< setuserfilter, 0: none
  std::array<double, 6> max_ratings{};                            ///< cfgmr
  std::array<std::int32_t, 6> bias_counts{};                      ///< setbias
  std::array<std::int32_t, 6> counts{};                           ///< runft
  std::uint32_t status = 0;                                       ///< runstat, hexadecimal
  std::uint32_t buffer_size = 10;                                 ///< comrdtbsiz
  Configuration configuration;                                    ///< cfg...: the requested one
  unsigned active_configuration = 0;                              ///< setcfgsel
  bool ethernet_ip = false;                                       ///< comeipe
  bool multi_unit = false;                                        ///< comrdtmsyn
  bool peak_logging = false;                                      ///< setpke
  std::array<std::int32_t, 6> highest_counts{}, lowest_counts{};  ///< runpkmx, runpkmn
  bool thresholds_enabled = false;                                ///< setmce
  std::array<Threshold, thresholds> threshold;                    ///< mce, mcx, mcc, mcv, mco
  std::uint32_t breached = 0;                                     ///< runmcb, one bit per threshold
  unsigned output_code = 0;  ///< runmco, combined code of the breached thresholds
  bool latched = false;      ///< runmcl
};

struct CalibrationPage {
  std::string serial;
  double counts_per_force = 1e6;   ///< calcpf, optional
  double counts_per_torque = 1e6;  ///< calcpt, optional
  // Written only.
  std::string part_number = {}, date = {};           ///< calpn, caldt
  std::string force_unit = "N", torque_unit = "Nm";  ///< scalfu, scaltu
  std::array<double, 6> max_ratings{};               ///< calmr
};

std::string encode(const SettingsPage& page);
std::string encode(const CalibrationPage& page);

/// Errors: parse, if cfgcpf, cfgcpt, scfgfu or scfgtu is missing or duplicate, a number is
/// unreadable or not positive, or the page is too large. Other tags are optional.
Result<SettingsPage> decode_settings(std::string_view xml);
/// Errors: as above, for calsn.
Result<CalibrationPage> decode_calibration(std::string_view xml);

/// Unit name of a configuration's code, 1 to 6; empty for any other code.
std::string_view force_unit_name(unsigned code);
std::string_view torque_unit_name(unsigned code);

/// Newtons (newton metres) per unit of the page. Errors: unsupported.
Result<double> newtons_per(std::string_view force_unit);
Result<double> newton_metres_per(std::string_view torque_unit);

}  // namespace weft::protocols::rdt
