// A run that waits takes its turn: a thread of its own performs it, and posts what happens to the
// desk.

#include <algorithm>
#include <utility>

#include "daemon/base/loop/caught.hpp"
#include "daemon/base/loop/free_memory.hpp"
#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {
namespace {

/// Whether what was recorded has no data set, and may get one yet. A file that is not to be read
/// may come back with its folder.
bool may_be_concluded(const std::filesystem::path& folder, const Result<CampaignSummary>& summary) {
  if (summary && !summary->dataset_error) return false;
  const auto only_end_left = is_only_end_left(folder);
  return only_end_left ? *only_end_left : summary.has_value();
}

}  // namespace

Result<CampaignRequest> RunDesk::request_of(const StoredRun& run) const {
  CampaignRequest request{run.recipe, around_.rig, run.folder, run.seed};
  request.resume = run.resume;
  request.accept_whole = true;
  if (Status here = store_.in_place(); !here) return pass(here.error());
  if (run.resume)
    if (Status there = is_where_it_was(run); !there) return pass(there.error());
  if (run.recipe_sha256.empty()) return request;
  auto text = store_.recipe_text(run.recipe_sha256);
  if (!text) return pass(text.error(), run.id());
  request.recipe_text = std::move(*text);
  return request;
}

bool RunDesk::may_begin(const Run& run) const {
  if (run.state() != RunState::queued || standing_.fact == RigStanding::Fact::latched) return false;
  return standing_.fact == RigStanding::Fact::safe || run.view.stored.id() == trusted_;
}

RunDesk::Run* RunDesk::next_in_line() const {
  for (const std::int64_t number : line_.runs) {
    Run* const run = numbered(number);
    if (run != nullptr && may_begin(*run)) return run;
  }
  return nullptr;
}

void RunDesk::begin_next() {
  if (active() || line_.held() || closing_) return;
  Run* const next = next_in_line();
  if (next == nullptr) return;
  // What it did would be forgotten, or there is no room for it; tick() looks again.
  disk_is_awaited_ = !store_.in_place() || !around_.room(around_.data, bytes_awaited(*next));
  if (!disk_is_awaited_ && is_rig_file_whole(*next)) begin(*next);
}

// Of `weft run` it was looked at just now, and nobody waits.
bool RunDesk::is_rig_file_whole(const Run& next) {
  const Status holds = around_.one_run ? Status{} : around_.rig_holds(around_.rig);
  if (!holds) hold_after(next, holds.error());
  return holds.has_value();
}

// One that goes on is refused without loss; it may only want its data set.
std::uint64_t RunDesk::bytes_awaited(const Run& run) {
  return run.view.stored.resume ? 0 : run.view.stored.disk_bytes;
}

std::uint64_t RunDesk::bytes_awaited() const {
  const Run* const next = next_in_line();
  return next == nullptr ? 0 : bytes_awaited(*next);
}

void RunDesk::begin(Run& run) {
  const bool plan_is_known = run.limits.arming.count() != 0;  // else it is from before a restart
  if (!plan_is_known) run.limits = Deadlines::of(0, 600);     // until its thread has looked
  // By now this may be another rig's desk, on which a resume will be refused.
  if (!run.view.stored.resume) run.view.stored.rig = around_.rig;
  run.view.stored.bench = to_string(bench_kind_of(around_.rig));
  run.view.stored.rig_untaken = true;
  run.view.since.reset();
  run.certified_at.reset();
  apply(run, on_begun(run.view.machine, run.limits, around_.now()), "auto:queue");
  run.orders.emplace();
  run.at_work = true;
  run.checked = run.took_rig = run.cut = false;
  run.aborted_by_end = false;
  run.leave = Run::Leave::awaited;
  run.thread = std::jthread([this, &run, hooks = hooks_of(run, plan_is_known),
                             resumes = run.view.stored.resume,
                             request = request_of(run.view.stored)] {
    auto summary = caught([&]() -> Result<CampaignSummary> {
      if (!request) return pass(request.error());
      return around_.perform(*request, hooks);
    });
    const bool may_be_left = !around_.one_run && (request || resumes);
    const bool left = may_be_left && (resumes || run.cut ? !request || is_anything_left(*request)
                                                         : may_be_concluded(request->out, summary));
    give_back_free_memory();
    around_.post([this, &run, left, summary = std::move(summary)] { ended(run, summary, left); });
  });
}

CampaignHooks RunDesk::hooks_of(Run& run, bool plan_is_known) {
  CampaignHooks hooks;
  hooks.orders = &*run.orders;
  hooks.onlooker = around_.onlooker;
  hooks.pace = around_.pace;
  hooks.rig_taken = [this, &run] { return take_rig(run); };
  hooks.planned = [this, &run, plan_is_known](const recipes::Plan& plan) {
    run.checked = true;
    if (plan_is_known) return;
    around_.post([this, &run, known = known_of(plan)] {
      plan_known(run, known);
      tell(run, "auto:run");
    });
  };
  hooks.moment = [this, &run](const RunMoment& moment) {
    around_.post([this, &run, moment] { moved(run, moment); });
  };
  hooks.vote = [this, &run](const VoteMoment& vote) {
    around_.post([this, &run, vote] {
      run.view.vote = vote;
      if (around_.voted) around_.voted(shown(run));
    });
  };
  hooks.progress = [this, &run](const TrialProgress& line) {
    around_.post([this, &run, line] { went_on(run, line); });
  };
  return hooks;
}

void RunDesk::went_on(Run& run, const TrialProgress& line) {
  run.view.trials_done = line.done;
  run.view.wall_left_s = line.wall_left_s;
  run.view.takes_rejected = line.takes_rejected;
  if (line.outcome == recipes::Outcome::rejected) note_rejected(run, line);
  tell(run, "auto:run");
}

}  // namespace weft::daemon::control
