#pragma once
// A device found at a port, as far as it describes itself.

#include <optional>
#include <string>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"
#include "protocols/apt/bodies.hpp"

namespace weft::daemon {

enum class DeviceKind : std::uint8_t {
  unknown,  ///< a port without a reply of the kinds below
  stage,
  net_ft,
  digital_ft,
  taxel_array,
  vibration_sensor,
  imprint_array
};
constexpr std::string_view to_string(DeviceKind kind) {
  constexpr std::array<std::string_view, 7> names{"unknown",      "stage",       "Net F/T",
                                                  "Digital F/T",  "taxel array", "vibration sensor",
                                                  "imprint array"};
  static_assert(names.size() == static_cast<std::size_t>(DeviceKind::imprint_array) + 1);
  return names[static_cast<std::size_t>(kind)];
}

/// Maximum length of a text from a device [bytes].
inline constexpr std::size_t max_text = 64;

struct FoundDevice {
  std::string place;  ///< as a person writes it: "/dev/ttyUSB0", "tcp:HOST:PORT", "HOST"
  LinkSettings link;  ///< for the rig file, with a stable name if there is one
  std::optional<LinkSettings> http;  ///< the pages of a Net F/T box
  DeviceKind kind = DeviceKind::unknown;
  std::string model;   ///< as reported: "KDC101", "Net F/T"; empty if none is
  std::string serial;  ///< of unit or calibration, as reported
  double rate_hz = 0;  ///< of its frames, records or readings; 0: unknown
  // Stages.
  std::vector<std::string> stages;  ///< that its controller may have; one entry if it is known
  std::uint8_t destination = protocols::apt::address::usb_unit;
  std::uint16_t stage_id = 0;  ///< as in HW_GET_INFO
  // Sensors.
  std::size_t taxels = 0;          ///< of a taxel array
  std::size_t rows = 0, cols = 0;  ///< of an imprint array
  double sound_rate_hz = 0;        ///< of a vibration sensor; `rate_hz` is that of its acceleration
  /// Notes for a person: "its calibration page could not be read".
  std::vector<std::string> notes;
  std::optional<Error> problem;  ///< why it could not be identified: in use, no permission
  /// A person named its place, or its USB numbers are Thorlabs'. It belongs to the bench: a rig
  /// file without it would be wrong.
  bool is_expected = false;
};

}  // namespace weft::daemon
