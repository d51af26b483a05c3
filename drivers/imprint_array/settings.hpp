#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/imprint/imprint.hpp"

namespace weft::drivers {

struct ImprintSettings {
  std::uint8_t rows = 0, cols = 0;  ///< of the part that is scanned
  /// Its first row and column; none: in the middle of the array that answers.
  std::optional<std::uint8_t> first_row, first_col;
  double rate_hz = 5;        ///< scans a second
  std::uint32_t serial = 0;  ///< that the array must have; 0: any
  Duration reply_timeout{};  ///< for the description, and then for the first scan
  Duration stale_after{};
  Duration watch{};  ///< windows in which scans, rate and clock are judged; zero: they are not
};

/// The part of an array of `rows` x `cols` taxels that the settings ask for.
/// Errors: device, where it does not lie inside.
Result<protocols::imprint::Window> window_on(const ImprintSettings& settings, std::uint8_t rows,
                                             std::uint8_t cols);

/// JSON Schema of the configuration.
extern const char imprint_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<ImprintSettings> read_imprint_settings(std::string_view config_json);

}  // namespace weft::drivers
