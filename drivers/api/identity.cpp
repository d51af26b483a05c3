#include <nlohmann/json.hpp>

#include "drivers/api/driver.hpp"

namespace weft {

// Text from a device need not be UTF-8: what is not becomes U+FFFD.
std::string to_json(const DeviceIdentity& identity) {
  nlohmann::json reported = nlohmann::json::object();
  nlohmann::json scale = nlohmann::json::object();
  for (const auto& [key, text] : identity.reported) reported[key] = text;
  for (const auto& [key, value] : identity.scale) scale[key] = value;
  return nlohmann::json{{"reported", reported}, {"scale", scale}}.dump(
      -1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace weft
