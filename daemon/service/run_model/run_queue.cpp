#include "daemon/service/run_model/run_queue.hpp"

#include <algorithm>
#include <iterator>

namespace weft::daemon::runs {

namespace {

/// Cause of an order that came too late for a complete run.
std::string_view late_cause(const EndedRun& run) {
  if (run.ordered == RunState::finishing) return after_stop;
  if (run.ordered == RunState::aborting) return after_abort;
  return run.ordered == RunState::halting ? after_halt : "";
}

}  // namespace

std::string_view pause_cause_of(const EndedRun& run) {
  if (run.is_disk_full) return without_disk;
  if (run.was_given_up) return after_failure;
  const bool covered = run.keep_going && run.acquired_rig;
  if (run.outcome == "complete" && !run.is_interrupted) return covered ? "" : late_cause(run);
  if (run.outcome == "stopped") return covered ? "" : after_stop;
  if (run.outcome == "aborted") return covered ? "" : after_abort;
  if (run.outcome == "failed") return covered ? "" : after_failure;
  return after_interruption;
}

std::size_t RunQueue::find_place(Run run) const {
  return static_cast<std::size_t>(std::ranges::find(runs_, run) - runs_.begin());
}

void RunQueue::put(Run run, std::size_t place) {
  std::erase(runs_, run);
  const std::size_t at = std::min(place, runs_.size());
  runs_.insert(runs_.begin() + static_cast<std::ptrdiff_t>(at), run);
  ++revision_;
}

bool RunQueue::remove(Run run) {
  if (std::erase(runs_, run) == 0) return false;
  if (runs_.empty() && paused_by_.starts_with("auto:")) paused_by_.clear();
  ++revision_;
  return true;
}

Status RunQueue::pause(std::string_view by) {
  if (is_paused())
    return fail({.code = Errc::wrong_state,
                 .where = "queue",
                 .what = "queue already paused",
                 .got = paused_by_});
  paused_by_ = by;
  ++revision_;
  return {};
}

Status RunQueue::resume() {
  if (!is_paused())
    return fail({.code = Errc::wrong_state, .where = "queue", .what = "queue not paused"});
  paused_by_.clear();
  ++revision_;
  return {};
}

bool RunQueue::pause_automatically(std::string_view cause) {
  return !cause.empty() && !runs_.empty() && pause(cause);
}

void RunQueue::on_restart(const std::vector<Run>& waiting) {
  std::erase_if(runs_, [&](Run run) { return std::ranges::count(waiting, run) == 0; });
  std::ranges::copy_if(waiting, std::back_inserter(runs_),
                       [this](Run run) { return find_place(run) == runs_.size(); });
  if (!runs_.empty() && !is_paused()) paused_by_ = after_restart;
  if (runs_.empty() && paused_by_.starts_with("auto:")) paused_by_.clear();
  ++revision_;
}

std::optional<RunQueue::Run> RunQueue::first_allowed(const RigState& rig,
                                                     const IsReady& is_ready) const {
  const auto found =
      std::ranges::find_if(runs_, [&](Run run) { return rig.can_move(run) && is_ready(run); });
  return found == runs_.end() ? std::nullopt : std::optional(*found);
}

std::optional<RunQueue::Run> RunQueue::next(const RigState& rig, const IsReady& is_ready) const {
  return is_paused() ? std::nullopt : first_allowed(rig, is_ready);
}

}  // namespace weft::daemon::runs
