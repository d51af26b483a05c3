// How a run ends, and who is told.

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {

using nlohmann::json;

void RunDesk::tell_end(Run& run) {
  for (const auto& each : std::exchange(run.waiting, {}))
    if (!each.listener.expired()) each.told(run.view);
}

/// How a run without a summary ended.
std::string_view RunDesk::outcome_of(const Run& run) {
  if (run.state() == RunState::finishing) return "stopped";  // asked for, while the bench came up
  return run.orders->ends_run() ? "aborted" : "failed";
}

/// What goes on and does not take the rig moves nothing, and cleans nothing up.
bool RunDesk::ends_as_before(const Run& run, bool had_rig) {
  return !had_rig && !run.view.stored.outcome.empty();
}

void RunDesk::doubt_rig_of(const Run& run, std::string_view by) {
  if (run.leave == Run::Leave::given && standing_.fact != RigStanding::Fact::latched)
    stand({RigStanding::Fact::unknown, run.view.stored.id()}, by);
}

void RunDesk::lose(Run& run) {
  StoredRun& stored = run.view.stored;
  const bool has_rig = run.leave == Run::Leave::given;  // its thread may ask, or be about to
  if (!ends_as_before(run, has_rig)) {
    stored.outcome = "failed";
    stored.cleanup = "skipped";
    stored.dataset_error.clear();
    stored.dataset_sha256 = certified_dataset(stored.folder);
  }
  stored.error = "the run does not answer";
  stored.rig_fact = has_rig ? "unknown" : to_string(standing_.fact);
  keep(run);
  tell_end(run);
}

void RunDesk::take_down(Run& run, const Result<CampaignSummary>& summary,
                        std::string_view cut_short) {
  StoredRun& stored = run.view.stored;
  const bool as_before = ends_as_before(run, run.took_rig);
  if (summary) {
    stored.outcome = recipes::to_string(summary->outcome);
    stored.error = summary->error ? to_string(*summary->error) : "";
    if (run.aborted_by_end && stored.outcome == "aborted" && stored.error.empty())
      stored.error = "aborted by the daemon, which was told to end";
    if (!as_before) stored.cleanup = recipes::to_string(summary->cleanup);
    stored.rig_fact = recipes::to_string(summary->rig);
    stored.dataset_error = summary->dataset_error ? to_string(*summary->dataset_error) : "";
    stored.dataset_sha256 = summary->dataset_sha256;
    run.view.wants_hand_over = summary->wants_hand_over;
    run.view.trials_done = summary->trials_complete;
    run.view.takes_rejected = summary->takes_rejected;
  } else {
    // That somebody ended it is told in any case.
    if (!as_before || cut_short != "failed") stored.outcome = cut_short;
    if (!as_before) {
      stored.cleanup = "skipped";
      stored.dataset_error.clear();
    }
    stored.rig_fact = "unknown";
    stored.error = to_string(summary.error());
    count_trials(run);  // of what was told the disk may have refused some, or more is on record
    stored.dataset_sha256 = certified_dataset(stored.folder);
  }
  if (run.took_rig) {
    stored.bench_outcome = stored.outcome;
    stored.bench_error = stored.error;
  } else if (summary && !stored.bench_outcome.empty()) {
    stored.outcome = stored.bench_outcome;
    stored.error = stored.bench_error;
  }
}

void RunDesk::ended(Run& run, const Result<CampaignSummary>& summary, bool may_go_on) {
  run.thread.join();  // this was its last word
  StoredRun& stored = run.view.stored;
  const std::string_view cut_short = outcome_of(run);
  take_down(run, summary, cut_short);
  run.at_work = false;
  refuse_faults(run);
  trusted_.clear();
  if (!run.took_rig)
    stored.rig_fact = to_string(standing_.fact);  // what it was
  else if (standing_.fact != RigStanding::Fact::latched)
    stand(stored.rig_fact == "safe" ? RigStanding{}
                                    : RigStanding{RigStanding::Fact::unknown, stored.id()},
          "auto:run");
  run.view.wall_left_s = 0;
  keep(run);  // also of one that had been given up
  apply(run, on_ended(may_go_on), "auto:run");
  tell_end(run);
  // What goes on may lack something of its own; a recipe was checked when it was put in line.
  const bool costs_all = run.checked || !stored.resume;
  if (!summary && costs_all && !run.took_rig && cut_short == "failed")
    hold_after(run, summary.error());
  begin_next();
}

void RunDesk::note_rejected(Run& run, const TrialProgress& line) {
  run.view.last_rejection = line.error ? to_string(*line.error) : "";
  const json payload{{"trial", line.done}, {"error", run.view.last_rejection}};
  note(run.view.stored.id(), "take_rejected", "auto:repeat_bad", payload.dump());
}

/// Of a run that the daemon's death cut: its file knows. False where that cannot be read.
bool RunDesk::count_trials(Run& run) {
  const auto found = load_progress(run.view.stored.folder / campaign_file_name);
  if (!found) return false;
  run.view.trials_done = found->done;
  run.view.trials_planned = found->planned;
  run.counted = true;
  keep(run);
  return true;
}

}  // namespace weft::daemon::control
