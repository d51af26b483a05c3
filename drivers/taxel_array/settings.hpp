#pragma once

#include <cstdint>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

enum class TaxelForm : std::uint8_t {
  weft,     ///< our own framing over a serial stream (protocols/taxel/README.md)
  cpm_udp,  ///< datagrams of the CPM-Finger's gateway
};

struct TaxelSettings {
  std::uint8_t taxels = 16;
  TaxelForm form = TaxelForm::weft;
  Duration reply_timeout{};  ///< for the first frame
  Duration stale_after{};
  double rate_hz = 37;
  Duration watch{};  ///< windows in which taxels, rate and clock are judged; zero: they are not
};

/// JSON Schema of the configuration.
extern const char taxel_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<TaxelSettings> read_taxel_settings(std::string_view config_json);

}  // namespace weft::drivers
