#pragma once
// Who may do what: four roles, each with everything that the ones before it may. Which method
// needs which: docs/api.md.

#include <cstdint>
#include <optional>
#include <string_view>

namespace weft::daemon::access {

enum class Role : std::uint8_t {
  observer,   ///< reads
  operator_,  ///< runs recipes
  engineer,   ///< edits recipes and limits within the hard caps, simulated faults
  admin,      ///< tokens, hard caps, other people's leases
};

std::string_view to_string(Role role);
std::optional<Role> role_from(std::string_view name);

}  // namespace weft::daemon::access
