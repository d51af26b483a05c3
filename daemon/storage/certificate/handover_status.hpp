#pragma once
// What became of a run's hand-over: a fact of its own, beside outcome, cleanup and rig.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace weft::daemon {

enum class HandoverState : std::uint8_t {
  none,       ///< the recipe wants none
  waiting,    ///< for the one before it
  running,    ///< on a thread of low priority
  done,       ///< handover/ is there
  failed,     ///< `error` says why; the run is what it is
  cancelled,  ///< by a person
};
std::string_view to_string(HandoverState state);
std::optional<HandoverState> handover_state_from(std::string_view word);
/// Nothing more comes of it by itself.
bool is_over(HandoverState state);

struct HandoverStatus {
  HandoverState state = HandoverState::none;
  std::string by;           ///< who asked for it last, or ended it
  std::string error;        ///< a sentence
  std::string result_json;  ///< handover_result_json(), once it is done
  /// So often it was begun and the daemon ended under it, not by anybody's wish.
  std::size_t attempts = 0;
  // While it runs; nothing of this is kept over a restart.
  std::size_t step = 0, steps = 0;
  std::string what = {};  ///< "M1: features of 340 trials"
};

}  // namespace weft::daemon
