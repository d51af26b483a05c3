#include "protocols/ati_digital/registers.hpp"

#include <string_view>

namespace weft::protocols::ati_digital {

std::string status_text(std::uint16_t status_word) {
  constexpr std::array<std::string_view, 16> names{"watchdog",
                                                   "excitation voltage high",
                                                   "excitation voltage low",
                                                   "artificial ground",
                                                   "supply voltage high",
                                                   "supply voltage low",
                                                   "bit 6",
                                                   "EEPROM",
                                                   "invalid configuration",
                                                   "gauge supply high",
                                                   "gauge supply low",
                                                   "thermistor high",
                                                   "thermistor low",
                                                   "gauge converter out of range",
                                                   "bit 14",
                                                   "bit 15"};
  std::string out;
  for (std::size_t bit = 0; bit < names.size(); ++bit)
    if ((status_word >> bit & 1) != 0) out += (out.empty() ? "" : ", ") + std::string(names[bit]);
  return out;
}

}  // namespace weft::protocols::ati_digital
