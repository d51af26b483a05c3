#pragma once
// The exploration phases of Khan et al. 2016, section III-B.

#include <cstdint>
#include <optional>
#include <string_view>

namespace weft {

enum class Phase : std::uint8_t {
  none = '-',    ///< approach, transfer and retraction: not part of the data set
  rest = 'S',    ///< rest: the weight of the probe alone, no force control
  press = 'P',   ///< press: force regulated, no motion
  motion = 'M',  ///< motion: force regulated
  end = 'E',     ///< rest again after the motion
};

constexpr char to_char(Phase phase) {
  return static_cast<char>(phase);
}

constexpr std::optional<Phase> phase_from_char(char c) {
  const bool known = std::string_view("-SPME").find(c) != std::string_view::npos;
  return known ? std::optional(static_cast<Phase>(c)) : std::nullopt;
}

}  // namespace weft
