// A run's turn at the rig: how it begins, what its thread reports, and how it ends.

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {
namespace {

/// As its thread has found them.
RunFacts found_facts(const RunResult& result, const RunView& run) {
  if (const auto& summary = result.summary)
    return {.outcome = std::string(recipes::to_string(summary->outcome)),
            .cleanup = std::string(recipes::to_string(summary->cleanup)),
            .rig_fact = std::string(recipes::to_string(summary->rig)),
            .error = format_error(summary->error),
            .dataset_sha256 = summary->dataset_sha256,
            .dataset_error = format_error(summary->dataset_error)};
  const bool is_stopped = run.state() == RunState::finishing;  // while the bench came up
  return {.outcome = is_stopped           ? "stopped"
                     : result.was_ordered ? "aborted"
                                          : "failed",
          .cleanup = "skipped",
          .rig_fact = "unknown",
          .error = to_string(result.summary.error()),
          .dataset_sha256 = certified_dataset(run.stored.folder)};
}

}  // namespace

Result<CampaignRequest> RunManager::request_of(const StoredRun& run) const {
  CampaignRequest request{run.recipe, context_.rig, run.folder, run.seed};
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

void RunManager::begin_next() {
  if (active() || closing_) return;
  const auto number = queue_.next(rig_);
  if (!number) return;
  Run& next = *numbered(*number);
  // What it did would be forgotten, or there is no space for it; tick() looks again.
  disk_is_awaited_ =
      !store_.in_place() || !context_.check_space(context_.data, status().bytes_awaited);
  if (disk_is_awaited_) return;
  // The daemon of a `weft run` has just checked it, and no other run waits.
  const Status usable = context_.one_run ? Status() : context_.check_rig_file(context_.rig);
  if (usable) return begin(next);
  RunChange change;
  if (!pause_after(next, usable.error(), change)) return;
  store_.persist(change);
  notify_queue(after_failure);
}

bool RunManager::pause_after(const Run& run, const Error& why, RunChange& change) {
  if (!queue_.on_cannot_begin()) return false;
  change.queue = queue_;
  change.journal.push_back(line("", "queue_paused", after_failure,
                                {{"run", run.stored.id()}, {"error", to_string(why)}}));
  return true;
}

void RunManager::begin(Run& run) {
  const bool plan_is_known = run.limits.arming.count() != 0;  // else it is from before a restart
  if (!plan_is_known) run.limits = Deadlines::of(0, 600);     // until its thread has looked
  StoredRun& stored = run.stored;
  // By now this may be another rig's daemon, on which a resume will be refused.
  if (!stored.resume) stored.rig = context_.rig;
  stored.bench = to_string(load_bench_kind(context_.rig));
  stored.rig_untaken = true;
  run.forget_folder();
  run.aborted_by_end = false;
  apply(run, on_begun(run.machine, run.limits, context_.now()), "auto:queue");
  executor_.begin(run.number(), plan_is_known, request_of(stored), stored.resume);
}

void RunManager::on_plan(std::int64_t number, const PlanSummary& plan) {
  Run& run = *numbered(number);
  use_plan(run, plan);
  notify(run, "auto:run");
}

void RunManager::on_moment(std::int64_t number, const RunStatusUpdate& moment) {
  Run& run = *numbered(number);
  run.moment = moment;
  run.trials_planned = moment.planned;
  const RunStep step = on_step(run.machine, run.limits, moment.step, context_.now());
  RunChange change;
  if (const OperatorPrompt* const opened =
          prompts_.on_step(number, step.next.state, moment, context_.now()))
    change.journal.push_back(line(run.stored.id(), "asked", by_recipe,
                                  {{"step", opened->step},
                                   {"text", opened->prompt.text},
                                   {"trial", opened->prompt.trial},
                                   {"people_s", opened->prompt.people_s}}));
  apply(run, step, "auto:run", std::move(change));
}

void RunManager::on_vote(std::int64_t number, const LiveVoteUpdate& vote) {
  Run& run = *numbered(number);
  run.vote = vote;
  context_.observer->on_vote(shown(run));
}

void RunManager::on_progress(std::int64_t number, const TrialProgress& progress) {
  Run& run = *numbered(number);
  run.trials_done = progress.done;
  run.wall_left_s = progress.wall_left_s;
  run.attempts_rejected = progress.attempts_rejected;
  run.force_rms_error_n = progress.force_rms_error_n;
  run.frames_lost = progress.frames_lost;
  run.recorder_lag_s = progress.recorder_lag_s;
  if (progress.outcome == recipes::Outcome::rejected) {
    run.last_rejection = format_error(progress.error);
    journal(run.stored.id(), "take_rejected", "auto:repeat_bad",
            {{"trial", progress.done}, {"error", run.last_rejection}});
  }
  notify(run, "auto:run");
}

bool RunManager::grant_rig(std::int64_t number) {
  if (rig_.is_latched()) return false;
  Run& run = *numbered(number);
  StoredRun taken = run.to_store();
  taken.rig_untaken = false;
  if (!store_.commit({.runs = {taken}})) return false;
  run.stored.rig_untaken = false;
  return true;
}

/// Every trial of a run that the daemon's death cut is in its file. False where that cannot be
/// read.
bool RunManager::count_trials(Run& run) {
  const auto found = load_progress(run.stored.folder / campaign_file_name);
  if (!found) return false;
  run.trials_done = found->done;
  run.trials_planned = found->planned;
  run.counted = true;
  return true;
}

void RunManager::give_up(Run& run, RunChange& change) {
  StoredRun& stored = run.stored;
  const bool has_rig = executor_.has_rig();
  if (has_rig && rig_.on_ended(false, run.number())) change.rig = rig_;
  stored.facts() = facts_without_answer(stored, has_rig, certified_dataset(stored.folder));
  stored.rig_fact = has_rig ? "unknown" : to_string(rig_.fact());
}

void RunManager::on_thread_ended(std::int64_t number, const RunResult& result) {
  Run& run = *numbered(number);
  StoredRun& stored = run.stored;
  const auto& summary = result.summary;
  RunEnd end{.found = found_facts(result, run),
             .has_summary = summary.has_value(),
             .acquired_rig = result.acquired_rig,
             .was_closing = run.aborted_by_end};
  RunChange change;
  if (!result.acquired_rig) {
    rig_.end_override();
    end.found.rig_fact = to_string(rig_.fact());  // what it was
  } else if (rig_.on_ended(end.found.rig_fact == "safe", number)) {
    change.rig = rig_;
  }
  stored.facts() = facts_of_end(stored, end);
  if (summary) {
    run.has_handover = summary->has_handover;
    run.trials_done = summary->trials_complete;
    run.attempts_rejected = summary->attempts_rejected;
  } else {
    count_trials(run);  // the disk may have refused some of what was reported, or has more
  }
  run.wall_left_s = 0;
  stage(run, on_ended(result.can_resume), "auto:run", change);
  change.put(run.to_store());  // also of one that had been given up
  // What is resumed may lack something of its own; a recipe was checked when it was queued.
  const bool costs_all = result.is_checked || !stored.resume;
  const bool no_bench =
      !summary && costs_all && !result.acquired_rig && end.found.outcome == "failed";
  const bool is_paused = no_bench && pause_after(run, summary.error(), change);
  store_.persist(change);
  if (change.rig) notify_rig("auto:run");
  notify(run, "auto:run");
  notify_ended(run);
  if (is_paused) notify_queue(after_failure);
  begin_next();
}

}  // namespace weft::daemon::runs
