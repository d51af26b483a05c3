#include "daemon/service/rpc/role.hpp"

#include <array>

namespace weft::daemon::access {
namespace {

constexpr std::array<std::string_view, 4> names{"observer", "operator", "engineer", "admin"};

}  // namespace

std::string_view to_string(Role role) {
  return names[static_cast<std::size_t>(role)];
}

std::optional<Role> role_from(std::string_view name) {
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == name) return static_cast<Role>(i);
  return std::nullopt;
}

}  // namespace weft::daemon::access
