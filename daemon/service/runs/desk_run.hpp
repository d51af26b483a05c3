#pragma once
// A run as the desk has it, on its thread and off it. For .cpp files of daemon/service/runs.

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "daemon/service/runs/run_desk.hpp"
#include "recipes/engine/forecast.hpp"
#include "recipes/engine/last_steps.hpp"
#include "recipes/engine/motion.hpp"

namespace weft::daemon::control {

/// Of the longest run that the plan allows: every take but each last is bad. A repetition that is
/// waited for may be the longest one, and its force may settle at the last moment. What is done
/// finally may take all of its budget: also after a stop the run may come to be complete.
inline Deadlines deadlines_of(const recipes::Plan& plan) {
  const std::vector<double> trials_s = recipes::trial_durations_s(plan);
  const recipes::Finally& last = plan.finally;
  const bool after_cut = !last.on_stop.empty() || !last.on_fault.empty();
  return Deadlines::of(plan.forecast.trials_s() * recipes::most_takes(plan),
                       *std::max_element(trials_s.begin(), trials_s.end()) + plan.settle.timeout_s,
                       {.finally_s = recipes::is_empty(last) ? 0 : last.budget_s,
                        .finally_cut_s = after_cut ? last.budget_s : 0,
                        .retreat_s = recipes::retreat_timeout_s(plan)});
}

/// Who holds a line after a run whose bench did not come up.
inline constexpr const char* after_failure = "auto:failed";

/// Where a run that goes on has its campaign: one that recorded something would begin anew,
/// somewhere else. Errors: not_found.
Status is_where_it_was(const StoredRun& run);

struct RunDesk::Run {
  RunView view;
  Deadlines limits{};
  std::optional<RunOrders> orders;  ///< of this turn; nothing before the first
  std::jthread thread;
  recipes::Ticket asked = 0;           ///< of what a person is asked for
  bool kept = true;                    ///< the store has it as it is
  bool counted = true;                 ///< how many trials are on record is known
  bool at_work = false;                ///< the thread has not told its end
  std::atomic<bool> checked = false;   ///< set by the thread: what it was asked for can be done
  std::atomic<bool> took_rig = false;  ///< likewise: it asked for the rig, and was not refused
  std::atomic<bool> cut = false;  ///< the daemon's end was the first to end it; read by the thread
  bool aborted_by_end = false;    ///< the daemon's end gave the order
  enum class Leave : std::uint8_t { awaited, given, refused };
  std::atomic<Leave> leave = Leave::awaited;  ///< to take the rig; the thread waits for it
  struct Curious {
    Recovery choice;
    PreviewTold told;
  };
  std::vector<Curious> curious;  ///< wait for what `looker` finds
  std::jthread looker;
  /// When the certificate in its folder was written, as it was read last.
  std::optional<std::filesystem::file_time_type> certified_at;
  bool settling = false;  ///< so `settler` is at work
  std::jthread settler;
  struct Waiting {
    std::function<void(const RunView&)> told;
    std::weak_ptr<const void> listener;
  };
  std::vector<Waiting> waiting;

  [[nodiscard]] RunState state() const { return view.machine.state; }
  [[nodiscard]] bool is_over() const {
    return state() == RunState::ended || state() == RunState::interrupted;
  }
  /// Nobody is needed for a run that ends, and what was asked is not asked any more.
  [[nodiscard]] bool may_need_people() const {
    return !is_over() && (state() < RunState::pausing || state() == RunState::awaiting_operator);
  }
};

}  // namespace weft::daemon::control
