// A run's turn at the rig: how it begins, what its thread reports, and how it ends.

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {
namespace {

using nlohmann::json;

/// What is resumed and does not take the rig moves nothing, and cleans nothing up.
bool ends_as_before(const StoredRun& run, bool had_rig) {
  return !had_rig && !run.outcome.empty();
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
  const json payload{{"run", run.view.stored.id()}, {"error", to_string(why)}};
  change.journal.push_back(line("", "queue_paused", after_failure, payload));
  return true;
}

void RunManager::begin(Run& run) {
  const bool plan_is_known = run.limits.arming.count() != 0;  // else it is from before a restart
  if (!plan_is_known) run.limits = Deadlines::of(0, 600);     // until its thread has looked
  StoredRun& stored = run.view.stored;
  // By now this may be another rig's daemon, on which a resume will be refused.
  if (!stored.resume) stored.rig = context_.rig;
  stored.bench = to_string(load_bench_kind(context_.rig));
  stored.rig_untaken = true;
  run.view.external_resume.reset();
  recovery_.forget_scan(run.number());
  run.aborted_by_end = false;
  apply(run, on_begun(run.view.machine, run.limits, context_.now()), "auto:queue");
  executor_.begin(run.number(), plan_is_known, request_of(stored), stored.resume);
}

void RunManager::on_plan(std::int64_t number, const PlanSummary& plan) {
  Run& run = *numbered(number);
  use_plan(run, plan);
  notify(run, "auto:run");
}

void RunManager::on_moment(std::int64_t number, const RunStatusUpdate& moment) {
  Run& run = *numbered(number);
  run.view.moment = moment;
  run.view.trials_planned = moment.planned;
  const RunStep step = on_step(run.view.machine, run.limits, moment.step, context_.now());
  RunChange change;
  if (prompts_.on_step(number, step.next.state, moment, context_.now())) {
    const OperatorPrompt& prompt = *prompts_.find(number);
    const json payload{{"step", prompt.step},
                       {"text", prompt.prompt.text},
                       {"trial", prompt.prompt.trial},
                       {"people_s", prompt.prompt.people_s}};
    change.journal.push_back(line(run.view.stored.id(), "asked", by_recipe, payload));
  }
  apply(run, step, "auto:run", std::move(change));
}

void RunManager::on_vote(std::int64_t number, const LiveVoteUpdate& vote) {
  Run& run = *numbered(number);
  run.view.vote = vote;
  if (context_.observer != nullptr) context_.observer->on_vote(shown(run));
}

void RunManager::on_progress(std::int64_t number, const TrialProgress& progress) {
  Run& run = *numbered(number);
  run.view.trials_done = progress.done;
  run.view.wall_left_s = progress.wall_left_s;
  run.view.attempts_rejected = progress.attempts_rejected;
  if (progress.outcome == recipes::Outcome::rejected) {
    run.view.last_rejection = progress.error ? to_string(*progress.error) : "";
    const json payload{{"trial", progress.done}, {"error", run.view.last_rejection}};
    store_.persist(
        {.journal = {line(run.view.stored.id(), "take_rejected", "auto:repeat_bad", payload)}});
  }
  notify(run, "auto:run");
}

bool RunManager::grant_rig(std::int64_t number) {
  if (rig_.is_latched()) return false;
  Run& run = *numbered(number);
  StoredRun taken = run.to_store();
  taken.rig_untaken = false;
  if (!store_.commit({.runs = {taken}})) return false;
  run.view.stored.rig_untaken = false;
  return true;
}

/// Every trial of a run that the daemon's death cut is in its file. False where that cannot be
/// read.
bool RunManager::count_trials(Run& run) {
  const auto found = load_progress(run.view.stored.folder / campaign_file_name);
  if (!found) return false;
  run.view.trials_done = found->done;
  run.view.trials_planned = found->planned;
  run.counted = true;
  return true;
}

void RunManager::give_up(Run& run, RunChange& change) {
  StoredRun& stored = run.view.stored;
  const bool has_rig = executor_.has_rig();
  if (has_rig && rig_.on_ended(false, run.number())) change.rig = rig_;
  if (!ends_as_before(stored, has_rig)) {
    stored.outcome = "failed";
    stored.cleanup = "skipped";
    stored.dataset_error.clear();
    stored.dataset_sha256 = certified_dataset(stored.folder);
  }
  stored.error = "the run does not answer";
  stored.rig_fact = has_rig ? "unknown" : to_string(rig_.fact());
}

void RunManager::record_result(Run& run, const RunResult& result, std::string_view cut_short) {
  StoredRun& stored = run.view.stored;
  const bool as_before = ends_as_before(stored, result.acquired_rig);
  if (const auto& summary = result.summary) {
    stored.outcome = recipes::to_string(summary->outcome);
    stored.error = summary->error ? to_string(*summary->error) : "";
    if (run.aborted_by_end && stored.outcome == "aborted" && stored.error.empty())
      stored.error = "aborted by the daemon, which was told to end";
    if (!as_before) stored.cleanup = recipes::to_string(summary->cleanup);
    stored.rig_fact = recipes::to_string(summary->rig);
    stored.dataset_error = summary->dataset_error ? to_string(*summary->dataset_error) : "";
    stored.dataset_sha256 = summary->dataset_sha256;
    run.view.has_handover = summary->has_handover;
    run.view.trials_done = summary->trials_complete;
    run.view.attempts_rejected = summary->attempts_rejected;
  } else {
    // An order that ended it is shown in any case.
    if (!as_before || cut_short != "failed") stored.outcome = cut_short;
    if (!as_before) {
      stored.cleanup = "skipped";
      stored.dataset_error.clear();
    }
    stored.rig_fact = "unknown";
    stored.error = to_string(summary.error());
    count_trials(run);  // the disk may have refused some of what was reported, or has more
    stored.dataset_sha256 = certified_dataset(stored.folder);
  }
  if (result.acquired_rig) {
    stored.bench_outcome = stored.outcome;
    stored.bench_error = stored.error;
  } else if (result.summary && !stored.bench_outcome.empty()) {
    stored.outcome = stored.bench_outcome;  // it only concludes: its end is that of its bench
    stored.error = stored.bench_error;
  }
}

void RunManager::on_thread_ended(std::int64_t number, const RunResult& result) {
  Run& run = *numbered(number);
  StoredRun& stored = run.view.stored;
  // How a run without a summary ended; "stopped": ordered while the bench came up.
  std::string_view cut_short = result.was_ordered ? "aborted" : "failed";
  if (run.state() == RunState::finishing) cut_short = "stopped";
  record_result(run, result, cut_short);
  RunChange change;
  if (!result.acquired_rig) {
    rig_.end_override();
    stored.rig_fact = to_string(rig_.fact());  // what it was
  } else if (rig_.on_ended(stored.rig_fact == "safe", number)) {
    change.rig = rig_;
  }
  run.view.wall_left_s = 0;
  stage(run, on_ended(result.can_resume), "auto:run", change);
  change.put(run.to_store());  // also of one that had been given up
  // What is resumed may lack something of its own; a recipe was checked when it was queued.
  const bool costs_all = result.is_checked || !stored.resume;
  const bool no_bench =
      !result.summary && costs_all && !result.acquired_rig && cut_short == "failed";
  const bool is_paused = no_bench && pause_after(run, result.summary.error(), change);
  store_.persist(change);
  if (change.rig && context_.observer != nullptr)
    context_.observer->on_rig_state_changed(rig_, "auto:run");
  notify(run, "auto:run");
  notify_ended(run);
  if (is_paused) notify_queue(after_failure);
  begin_next();
}

}  // namespace weft::daemon::runs
