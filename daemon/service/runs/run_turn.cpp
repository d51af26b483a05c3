// Execution of a run: its start, the reports of its thread, and its end.

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {
namespace {

std::string format_promise_fact(const SimulationNote& simulation) {
  if (!simulation.promise) return {};
  return simulation.promise->held ? "held" : "missed";
}

/// Facts as reported by the run's thread.
RunFacts found_facts(const RunResult& result, const RunView& run) {
  if (const auto& summary = result.summary)
    return {.outcome = std::string(recipes::to_string(summary->outcome)),
            .cleanup = std::string(recipes::to_string(summary->cleanup)),
            .rig_fact = std::string(recipes::to_string(summary->rig)),
            .error = format_error(summary->error),
            .dataset_sha256 = summary->dataset_sha256,
            .dataset_error = format_error(summary->dataset_error),
            .promise = format_promise_fact(summary->simulation)};
  const bool is_stopped = run.state() == RunState::finishing;  // while the bench started
  return {.outcome = is_stopped           ? "stopped"
                     : result.was_ordered ? "aborted"
                                          : "failed",
          .cleanup = "skipped",
          .rig_fact = "unknown",
          .error = to_string(result.summary.error()),
          .dataset_sha256 = certified_dataset(run.stored.folder)};
}

bool is_disk_full(const RunResult& result) {
  const auto is_full = [](const std::optional<Error>& error) {
    return error && error->code == Errc::no_space;
  };
  return result.summary ? is_full(result.summary->error) || is_full(result.summary->dataset_error)
                        : result.summary.error().code == Errc::no_space;
}

}  // namespace

Result<CampaignRequest> RunManager::request_of(const StoredRun& run) const {
  CampaignRequest request{run.recipe, context_.rig, run.folder, run.seed};
  request.resume = run.resume;
  request.accept_whole = true;
  if (!run.only_fabric.empty()) request.only_fabric = run.only_fabric;
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
  if (active() || maintenance_.order() || closing_) return;
  const auto number = queue_.next(rig_, [this](std::int64_t run) { return is_ready(run); });
  if (!number) return;
  Run& next = *numbered(*number);
  const Status storage = check_storage();
  // The daemon of a `weft run` has just checked the rig file, and no other run is queued.
  const Status usable =
      storage && !context_.one_run ? context_.check_rig_file(context_.rig) : storage;
  if (usable) return begin(next);
  const char* const cause = storage ? without_rig_file : without_disk;
  RunChange change;
  pause_queue_for(cause, {{"run", next.stored.id()}, {"error", to_string(usable.error())}}, change);
  store_.persist(change);
  notify_queue(cause);
}

// Motion that starts when disk space becomes free would be a surprise. Therefore the queue is
// paused, and a person resumes it.
Status RunManager::check_storage() const {
  if (Status here = store_.in_place(); !here) return here;
  if (!store_.is_persisted())
    return fail({.code = Errc::no_space,
                 .where = context_.data.string(),
                 .what = "earlier changes not yet written to the disk",
                 .hint = "Free disk space, then run weft queue start"});
  return context_.check_space(context_.data, status().bytes_awaited);
}

void RunManager::pause_queue_for(std::string_view cause, const nlohmann::json& why,
                                 RunChange& change) {
  if (!queue_.pause_automatically(cause)) return;
  change.queue = queue_;
  change.journal.push_back(line("", "queue_paused", cause, why));
}

void RunManager::carry_pause_over(Run& run, RunChange& change) {
  run.pause_is_carried_over = true;
  const std::string by = std::exchange(run.pause_ordered_by, {});
  if (!queue_.pause(by)) return;  // it is paused already
  change.queue = queue_;
  change.journal.push_back(
      line("", "queue_paused", by, {{"run", run.stored.id()}, {"carried_over", true}}));
}

void RunManager::begin(Run& run) {
  const bool plan_is_known = run.limits.arming.count() != 0;  // else from before a restart
  if (!plan_is_known) run.limits = Deadlines::of(0, 600);     // until its thread has the plan
  StoredRun& stored = run.stored;
  // This may be the daemon of another rig, on which a resume will be refused.
  if (!stored.resume) stored.rig = context_.rig;
  stored.bench = to_string(load_bench_kind(context_.rig));
  stored.rig_untaken = true;
  run.forget_folder();
  run.aborted_by_end = run.pause_is_carried_over = run.was_given_up = false;
  run.end_ordered_by.clear();
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
  run.forecast = moment.forecast;
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
  if (rig_.is_latched() || rig_.facts().lock_out) return false;
  Run& run = *numbered(number);
  StoredRun taken = run.to_store();
  taken.rig_untaken = false;
  if (!store_.commit({.runs = {taken}})) return false;
  run.stored.rig_untaken = false;
  return true;
}

/// Counts the trials in the file of a run that was interrupted by the daemon's death. False if the
/// file cannot be read.
bool RunManager::count_trials(Run& run) {
  const auto found = load_progress(run.stored.folder / campaign_file_name);
  if (!found) return false;
  run.trials_done = found->done;
  run.trials_planned = found->planned;
  run.counted = true;
  return true;
}

void RunManager::give_up(Run& run, RunChange& change) {
  run.was_given_up = true;
  StoredRun& stored = run.stored;
  const bool has_rig = executor_.has_rig();
  if (has_rig && rig_.on_ended(RigFact::unknown, run.stored.id())) change.rig = rig_;
  stored.facts() = facts_without_answer(stored, has_rig, certified_dataset(stored.folder));
  stored.rig_fact = to_string(rig_.facts().fact);
  pause_queue_for(after_failure, {{"run", stored.id()}, {"error", stored.error}}, change);
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
    end.found.rig_fact = to_string(rig_.facts().fact);  // unchanged
  } else if (rig_.on_ended(rig_fact_of(end.found.rig_fact), stored.id())) {
    change.rig = rig_;
  }
  stored.facts() = facts_of_end(stored, end);
  if (summary) {
    run.has_handover = summary->has_handover;
    run.trials_done = summary->trials_complete;
    run.attempts_rejected = summary->attempts_rejected;
  } else {
    count_trials(run);  // the disk may have refused reported trials, or has more of them
  }
  const RunState before = run.state();
  const std::string by = run.end_ordered_by.empty() ? "auto:run" : run.end_ordered_by;
  stage(run, on_ended(result.can_resume), by, change);
  change.put(run.to_store());  // also if it had been given up
  if (before == RunState::pausing && !run.pause_ordered_by.empty()) carry_pause_over(run, change);
  pause_queue_for(pause_cause_of({.outcome = stored.outcome,
                                  .keep_going = stored.keep_going,
                                  .acquired_rig = result.acquired_rig,
                                  .is_disk_full = is_disk_full(result),
                                  .is_interrupted = run.state() == RunState::interrupted,
                                  .ordered = before,
                                  .was_given_up = run.was_given_up}),
                  {{"run", stored.id()}, {"error", stored.error}}, change);
  store_.persist(change);
  if (change.rig) notify_rig(by);
  notify(run, by);
  if (change.queue) notify_queue(by);
  notify_ended(run);
  begin_next();
}

}  // namespace weft::daemon::runs
