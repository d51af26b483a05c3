#pragma once
// The settings page of a Net F/T box, `GET /netftapi2.xml` on its HTTP port, and its calibration
// page /netftcalapi.xml (reference B.3). Text in, text out; no I/O.

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
  std::array<double, 6> tool_transform{};     ///< cfgtfx, mm and degrees
  std::uint32_t status = 0;                   ///< runstat, hexadecimal
  std::uint32_t buffer_size = 10;             ///< comrdtbsiz
};

struct CalibrationPage {
  std::string serial;
  double counts_per_force = 1e6;
  double counts_per_torque = 1e6;
};

std::string encode(const SettingsPage& page);
std::string encode(const CalibrationPage& page);

/// Errors: parse, when one of prodname, cfgcpf, cfgcpt, scfgfu, scfgtu is not there once, a number
/// is none or is not above zero, or the page is too large.
Result<SettingsPage> decode_settings(std::string_view xml);
/// Errors: as above, for calsn, calcpf and calcpt.
Result<CalibrationPage> decode_calibration(std::string_view xml);

/// How many newtons (newton metres) the page's unit has. Errors: unsupported.
Result<double> newtons_per(std::string_view force_unit);
Result<double> newton_metres_per(std::string_view torque_unit);

/// The path and query of "GET /path?query HTTP/1.1 ...", once the blank line has come; HEAD asks
/// for what GET would say, without its body. Errors: parse, for another method or an over-long
/// request.
struct HttpRequest {
  std::string path, query;
  bool head_only = false;
  bool keep_alive = true;
};
Result<HttpRequest> decode_request_head(std::string_view head);
/// The value of a key in "a=1&b=2"; nothing when it is not there.
std::optional<std::string_view> query_value(std::string_view query, std::string_view key);
std::string http_get(std::string_view path, std::string_view host);
std::string http_reply(int status, std::string_view type, std::string_view body, bool keep_alive);

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
