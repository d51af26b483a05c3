#pragma once
// A run as clients see it, and what is called when it, the queue or the rig changes.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/campaign/campaign.hpp"
#include "daemon/service/run_model/operator_prompts.hpp"
#include "daemon/service/run_store/run_store.hpp"
#include "daemon/storage/certificate/handover_file.hpp"

namespace weft::daemon::runs {

/// What the folder of an ended run holds, where its campaign was resumed afterwards by
/// `weft run --resume` and not by the daemon.
struct ExternalResume {
  std::size_t trials_done = 0, trials_planned = 0;
  bool complete = false;  ///< it came to its end with all of them
  std::string dataset_sha256;
  friend bool operator==(const ExternalResume&, const ExternalResume&) = default;
};

struct RunView {
  StoredRun stored;
  RunStateMachine machine;
  std::optional<RunStatusUpdate> moment;
  std::optional<LiveVoteUpdate> vote;             ///< the newest of its recipe's live votes
  std::optional<OperatorPrompt> operator_prompt;  ///< the next human action
  std::size_t trials_done = 0;
  std::size_t trials_planned = 0;
  std::size_t attempts_rejected = 0;       ///< bad ones that were taken again
  std::string last_rejection;              ///< why the newest of them was
  double wall_left_s = 0;                  ///< by the mean of the trials done, and people's time
  std::string changed_by;                  ///< the user, session or rule that changed it last
  std::optional<HandoverStatus> handover;  ///< where its recipe has one and it is complete
  /// Whether its recipe has one, once the run has ended in this life of the daemon.
  std::optional<bool> has_handover = {};
  std::optional<ExternalResume> external_resume = {};

  [[nodiscard]] RunState state() const { return machine.state; }
  [[nodiscard]] bool is_over() const {
    return state() == RunState::ended || state() == RunState::interrupted;
  }
};

/// Called on the server's thread, when the change is written or waits to be. `by`: a user, a
/// session or a rule.
class RunObserver {
 public:
  RunObserver() = default;
  RunObserver(const RunObserver&) = delete;
  RunObserver& operator=(const RunObserver&) = delete;
  virtual ~RunObserver() = default;
  virtual void on_run_changed(const RunView& run) = 0;
  virtual void on_vote(const RunView& run) = 0;
  virtual void on_queue_changed(const RunQueue& queue, std::string_view by) = 0;
  /// Also of a halt that changes nothing.
  virtual void on_rig_state_changed(const RigState& rig, std::string_view by) = 0;
};

}  // namespace weft::daemon::runs
