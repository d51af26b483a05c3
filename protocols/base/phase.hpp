#pragma once
// The exploration phases of Khan et al. 2016, section III-B.

#include <cstdint>
#include <optional>

namespace weft {

enum class Phase : std::uint8_t {
  none = '-',    ///< approach, transfer and retreat: not part of the data set
  rest = 'S',    ///< resting: the sensor's weight alone, no force control
  press = 'P',   ///< pressure: force controlled, no motion
  motion = 'M',  ///< motion at constant force
  end = 'E',     ///< resting again after the motion
};

constexpr char to_char(Phase phase) {
  return static_cast<char>(phase);
}

constexpr std::optional<Phase> phase_from_char(char c) {
  switch (c) {
    case '-':
      return Phase::none;
    case 'S':
      return Phase::rest;
    case 'P':
      return Phase::press;
    case 'M':
      return Phase::motion;
    case 'E':
      return Phase::end;
    default:
      return std::nullopt;
  }
}

}  // namespace weft
