#pragma once
// The settings page of a Net F/T box, `GET /netftapi2.xml` on its HTTP port, and its calibration
// page /netftcalapi.xml (device-facts.md, Net F/T pages). Text in, text out; no I/O.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::rdt {

inline constexpr std::string_view settings_path = "/netftapi2.xml";
inline constexpr std::string_view calibration_path = "/netftcalapi.xml";
inline constexpr std::size_t largest_page = 65536;

inline constexpr std::size_t configurations = 16, thresholds = 16;

/// One of a box's configurations, as /config.cgi sets it. Codes of units: WriteTransform's, and
/// those of force_unit_name() and torque_unit_name().
struct Configuration {
  std::string name = "Weft";
  unsigned calibration = 0;
  unsigned force_unit = 2, torque_unit = 3, distance_unit = 3, angle_unit = 1;
  std::array<double, 6> tool_transform{};  ///< dx dy dz rx ry rz, in those units
  std::string user_a, user_b;
};

/// One of a box's threshold statements, as /moncon.cgi sets it.
struct Threshold {
  bool enabled = false;
  int axis = -1;             ///< 0 Fx to 5 Tz; -1: none
  int comparison = 1;        ///< 1: above the value, -1: below
  std::int32_t counts = 0;   ///< the value
  unsigned output_code = 0;  ///< 0 to 255
};

/// The tags that clients use. Lists of six are Fx Fy Fz Tx Ty Tz.
struct SettingsPage {
  std::string product = "Net F/T";
  double counts_per_force = 1e6;    ///< cfgcpf
  double counts_per_torque = 1e6;   ///< cfgcpt
  std::string force_unit = "N";     ///< scfgfu
  std::string torque_unit = "N-m";  ///< scfgtu
  bool rdt_enabled = true;          ///< comrdte
  double rdt_rate_hz = 0;           ///< comrdtrate
  // Written only.
  std::string calibration_serial;             ///< cfgcalsn
  unsigned user_filter = 0;                   ///< setuserfilter, 0: none
  std::array<double, 6> max_ratings{};        ///< cfgmr
  std::array<std::int32_t, 6> bias_counts{};  ///< setbias
  std::array<std::int32_t, 6> counts{};       ///< runft
  std::uint32_t status = 0;                   ///< runstat, hexadecimal
  std::uint32_t buffer_size = 10;             ///< comrdtbsiz
  Configuration configuration;                ///< cfg...: the one that was asked for
  unsigned active_configuration = 0;          ///< setcfgsel
  bool ethernet_ip = false;                   ///< comeipe
  bool multi_unit = false;                    ///< comrdtmsyn
  bool peak_logging = false;                  ///< setpke
  std::array<std::int32_t, 6> highest_counts{}, lowest_counts{};  ///< runpkmx, runpkmn
  bool thresholds_enabled = false;                                ///< setmce
  std::array<Threshold, thresholds> threshold;                    ///< mce, mcx, mcc, mcv, mco
  std::uint32_t breached = 0;  ///< runmcb, a bit for each threshold
  unsigned output_code = 0;    ///< runmco, of those together
  bool latched = false;        ///< runmcl
};

struct CalibrationPage {
  std::string serial;
  double counts_per_force = 1e6;
  double counts_per_torque = 1e6;
  // Written only.
  std::string part_number = {}, date = {};            ///< calpn, caldt
  std::string force_unit = "N", torque_unit = "N-m";  ///< scalfu, scaltu
  std::array<double, 6> max_ratings{};                ///< calmr
};

std::string encode(const SettingsPage& page);
std::string encode(const CalibrationPage& page);

/// Errors: parse, when one of prodname, cfgcpf, cfgcpt, scfgfu, scfgtu is not there once, a number
/// is none or is not above zero, or the page is too large.
Result<SettingsPage> decode_settings(std::string_view xml);
/// Errors: as above, for calsn, calcpf and calcpt.
Result<CalibrationPage> decode_calibration(std::string_view xml);

/// The names of a configuration's codes, 1 to 6; empty for another.
std::string_view force_unit_name(unsigned code);
std::string_view torque_unit_name(unsigned code);

/// How many newtons (newton metres) the page's unit has. Errors: unsupported.
Result<double> newtons_per(std::string_view force_unit);
Result<double> newton_metres_per(std::string_view torque_unit);

/// The path and query of "GET /path?query HTTP/1.1 ...", once the blank line has come ("GET
/// http://box/path ..." alike); HEAD asks for what GET would say, without its body. Errors: parse,
/// for another method or an over-long request.
struct HttpRequest {
  std::string path, query;
  bool head_only = false;
};
Result<HttpRequest> decode_request_head(std::string_view head);
/// The value of a key in "a=1&b=2"; nothing when it is not there.
std::optional<std::string_view> query_value(std::string_view query, std::string_view key);
std::string http_get(std::string_view path, std::string_view host);
/// A reply of HTTP/1.0, after which the connection is closed, whatever the request says: public
/// clients of the box read to the end (no document says it). `location`: where a 302 sends to.
std::string http_reply(int status, std::string_view type, std::string_view body,
                       std::string_view location = {});

/// Puts an HTTP reply together: push() what comes, until complete() or an error; any chunking
/// gives the same. Without a Content-Length the page ends with its root element.
class HttpReply {
 public:
  /// Errors: parse, when the reply is no page, comes in chunks (Transfer-Encoding) or is too large.
  Status push(ByteView bytes);
  /// All of the body is there.
  [[nodiscard]] bool complete() const { return end() != std::string::npos; }
  [[nodiscard]] std::string_view body() const;
  void clear() { *this = {}; }

 private:
  static constexpr std::size_t unknown_length = std::string::npos;
  [[nodiscard]] std::size_t end() const;  ///< of the body; npos until all of it is there
  std::string text_;
  std::size_t body_at_ = 0;  ///< 0: the head is not complete
  std::size_t length_ = 0;
};

}  // namespace weft::protocols::rdt
