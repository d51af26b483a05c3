#pragma once

#include <array>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

struct NetftSettings {
  double newton_per_count = 1e-6;
  double newton_metre_per_count = 1e-6;
  /// Fz of the sample = sign_z * Fz of the device. +1 where pushing the plate down is positive.
  double sign_z = 1;
  std::array<double, 3> rated_force_n{40, 40, 120};  ///< Mini40 SI-40-2, weak source
  Duration reply_timeout{};                          ///< of each of a few opening requests
  Duration stale_after{};
  /// The configuration names counts per newton (metre): a page that differs is refused. Otherwise
  /// the page's are taken.
  bool force_scale_given = false;
  bool torque_scale_given = false;
  std::string calibration_serial;  ///< compared with the page's; empty: any
  double rate_hz = 100;
  Duration stuck_after{};  ///< values that stay the same for so long are a fault; zero: never
};

/// JSON Schema of the configuration.
extern const char netft_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<NetftSettings> read_netft_settings(std::string_view config_json);

}  // namespace weft::drivers
