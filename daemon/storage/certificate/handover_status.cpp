#include "daemon/storage/certificate/handover_status.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 6> state_names{"none", "waiting", "running",
                                                      "done", "failed",  "cancelled"};

}  // namespace

std::string_view to_string(HandoverState state) {
  return state_names[static_cast<std::size_t>(state)];
}

std::optional<HandoverState> handover_state_from(std::string_view word) {
  const auto* found = std::find(state_names.begin(), state_names.end(), word);
  if (found == state_names.end()) return std::nullopt;
  return static_cast<HandoverState>(found - state_names.begin());
}

bool is_over(HandoverState state) {
  return state != HandoverState::waiting && state != HandoverState::running;
}

}  // namespace weft::daemon
