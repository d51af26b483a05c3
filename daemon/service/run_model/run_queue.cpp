#include "daemon/service/run_model/run_queue.hpp"

#include <algorithm>
#include <iterator>

namespace weft::daemon::runs {

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
  ++revision_;
  return true;
}

Status RunQueue::pause(std::string_view by) {
  if (is_paused())
    return fail({.code = Errc::wrong_state,
                 .where = "queue",
                 .what = "the queue is paused already",
                 .got = paused_by_});
  paused_by_ = by;
  ++revision_;
  return {};
}

Status RunQueue::resume() {
  if (!is_paused())
    return fail({.code = Errc::wrong_state, .where = "queue", .what = "the queue is not paused"});
  paused_by_.clear();
  ++revision_;
  return {};
}

bool RunQueue::on_cannot_begin() {
  return !runs_.empty() && pause(after_failure);
}

void RunQueue::on_restart(const std::vector<Run>& waiting) {
  std::erase_if(runs_, [&](Run run) { return std::ranges::count(waiting, run) == 0; });
  std::ranges::copy_if(waiting, std::back_inserter(runs_),
                       [this](Run run) { return find_place(run) == runs_.size(); });
  if (!runs_.empty() && !is_paused()) paused_by_ = after_restart;
  if (runs_.empty() && paused_by_ == after_restart) paused_by_.clear();
  ++revision_;
}

std::optional<RunQueue::Run> RunQueue::first_allowed(const RigState& rig) const {
  const auto found = std::ranges::find_if(runs_, [&](Run run) { return rig.can_move(run); });
  return found == runs_.end() ? std::nullopt : std::optional(*found);
}

std::optional<RunQueue::Run> RunQueue::next(const RigState& rig) const {
  return is_paused() ? std::nullopt : first_allowed(rig);
}

}  // namespace weft::daemon::runs
