#include "daemon/storage/certificate/hand_over_fact.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 6> state_words{"none", "waiting", "running",
                                                      "done", "failed",  "cancelled"};

}  // namespace

std::string_view to_string(HandOverState state) {
  return state_words[static_cast<std::size_t>(state)];
}

std::optional<HandOverState> hand_over_state_from(std::string_view word) {
  const auto* found = std::find(state_words.begin(), state_words.end(), word);
  if (found == state_words.end()) return std::nullopt;
  return static_cast<HandOverState>(found - state_words.begin());
}

bool is_over(HandOverState state) {
  return state != HandOverState::waiting && state != HandOverState::running;
}

}  // namespace weft::daemon
