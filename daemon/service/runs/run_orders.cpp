// What people order: of runs and their queue, of the rig, and of interrupted runs.

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {

using nlohmann::json;

Status RunManager::commit(RunQueue queue, RunChange change) {
  change.queue = queue;
  Status persisted = store_.commit(change);
  if (persisted) queue_ = std::move(queue);
  return persisted;
}

Status RunManager::change_queue(RunQueue queue, JournalLine line, std::string_view by) {
  if (Status persisted = commit(std::move(queue), {.journal = {std::move(line)}}); !persisted)
    return persisted;
  notify_queue(by);
  begin_next();
  return {};
}

Status RunManager::commit_transition(Run& run, StoredRun stored, const RunStateMachine& machine,
                                     std::string_view by) {
  stored.state = machine.state;
  RunQueue queue = queue_;
  if (machine.state == RunState::queued)
    queue.put(stored.number, 0);
  else
    queue.remove(stored.number);
  Status persisted =
      commit(std::move(queue), {.runs = {stored}, .journal = {state_line(stored, by)}});
  if (!persisted) return persisted;
  run.stored = std::move(stored);
  run.machine = machine;
  prompts_.on_state(run.number(), machine.state);
  notify_queue(by);
  return {};
}

Status RunManager::remove(std::string_view id, std::string_view by) {
  const auto found = find_queued(id, "the run has begun", "run.stop or run.abort ends it");
  if (!found) return pass(found.error());
  Run& run = **found;
  StoredRun stored = run.stored;
  const bool was_resumed = stored.resume;
  if (!was_resumed) {
    stored.outcome = "stopped";
    stored.cleanup = "skipped";
    stored.rig_fact = to_string(rig_.fact());  // nothing was moved
  }
  const RunStateMachine next = on_ended(was_resumed).next;
  if (Status persisted = commit_transition(run, std::move(stored), next, by); !persisted)
    return persisted;
  rig_.end_override(run.number());
  notify(run, by);
  notify_ended(run);
  return {};
}

Status RunManager::move(std::string_view id, std::size_t place, std::string_view by) {
  const auto run = find_queued(id, "the run does not wait in line", "");
  if (!run) return pass(run.error());
  RunQueue next = queue_;
  next.put((*run)->number(), place);
  const std::size_t found = next.find_place((*run)->number());
  return change_queue(std::move(next), line(id, "moved", by, {{"place", found}}), by);
}

Status RunManager::pause_queue(std::string_view by) {
  RunQueue next = queue_;
  if (Status ok = next.pause(by); !ok) return ok;
  return change_queue(std::move(next), line("", "queue_paused", by), by);
}

Status RunManager::resume_queue(std::string_view by) {
  if (Status more = require_accepting(); !more) return more;
  RunQueue next = queue_;
  if (Status ok = next.resume(); !ok) return ok;
  return change_queue(std::move(next), line("", "queue_started", by), by);
}

Result<RunView> RunManager::order(std::string_view id, Order order, std::string_view by,
                                  std::string_view confirms) {
  const auto found = find(id);
  if (!found) return pass(found.error());
  Run& run = **found;
  const auto step = on_order(run.machine, run.limits, order, context_.now());
  if (!step) {
    Error refused = step.error();
    if (order == Order::resume && refused.hint.empty()) refused.hint = resume_hint(run);
    return pass(std::move(refused), run.stored.id());
  }
  if (order == Order::confirm) {
    if (Status ok = prompts_.check(run.number(), confirms); !ok) return pass(ok.error());
    journal(id, "confirmed", by, {{"step", confirms}});  // before the rig may move
  }
  apply(run, *step, by);
  return shown(run);
}

// Motion first, then what has to reach the disk.
void RunManager::halt(RigState::Stop stop, std::string_view by, std::string_view reason) {
  RunChange change;
  bool is_news = false;
  std::vector<Run*> halted;
  for (const auto& run : runs_) {
    const auto step = on_order(run->machine, run->limits, Order::halt, context_.now());
    if (!step) continue;
    is_news = is_news || step->next.state != run->state();
    stage(*run, *step, by, change);
    halted.push_back(run.get());
  }
  const RigState before = rig_;
  is_news = rig_.halt(stop, by, reason) || is_news;
  if (rig_ != before) change.rig = rig_;
  const std::string kind = stop == RigState::Stop::emergency ? "estop" : "halt";
  const json payload = reason.empty() ? json::object() : json{{"reason", reason}};
  if (repeated_stops_.is_journalled({kind, std::string(by), std::string(reason)}, is_news,
                                    context_.now()))
    change.journal.push_back(line("", kind, by, payload));
  if (!change.is_empty()) store_.persist(change);
  for (Run* const run : halted) notify(*run, by);
  notify_rig(by);
}

void RunManager::journal_repeated(const std::vector<RepeatedStops::Counted>& counted) {
  RunChange change;
  for (const auto& [stop, since, times] : counted) {
    json payload{{"repeated", times}};
    if (!stop.reason.empty()) payload["reason"] = stop.reason;
    change.journal.push_back(line("", stop.kind, stop.by, payload));
  }
  if (!change.is_empty()) store_.persist(change);
}

Status RunManager::reset(std::string_view reason, std::string_view by) {
  if (Status more = require_accepting(); !more) return more;
  if (rig_.is_safe())
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "the rig is neither latched nor unknown"});
  if (reason.size() < 3)
    return fail({.code = Errc::invalid_argument,
                 .where = "/params/reason",
                 .what = "a reset needs a reason",
                 .expected = "a few words",
                 .got = std::string(reason)});
  if (const auto run = active())
    return fail({.code = Errc::wrong_state,
                 .where = *run,
                 .what = "a run has not ended yet",
                 .expected = "ended",
                 .hint = "Wait for it; one that does not answer ends with the daemon"});
  journal_repeated(repeated_stops_.take());
  Status persisted =
      store_.commit({.rig = RigState(), .journal = {line("", "reset", by, {{"reason", reason}})}});
  if (!persisted) return persisted;
  rig_ = RigState();
  notify_rig(by);
  if (queue_.paused_by() == after_restart) static_cast<void>(resume_queue(by));
  begin_next();
  return {};
}

void RunManager::inject_fault(FaultOrder order, FaultCallback on_done) {
  if (!executor_.run())
    return on_done(fail({.code = Errc::wrong_state,
                         .where = "/rig",
                         .what = "no run is under way, and the bench is there with one only",
                         .hint = "Start one; faults for all of a run are in the rig file, under "
                                 "simulation.faults"}));
  const json payload{{"fault", json::parse(order.json)}, {"ends", order.ends}};
  auto journalled = [this, id = run_id(*executor_.run()), by = order.by, payload,
                     on_done = std::move(on_done)](const Status& done) {
    if (done) journal(id, "fault", by, payload);
    on_done(done);
  };
  executor_.inject(std::move(order), std::move(journalled));
}

Result<RunManager::Run*> RunManager::find_interrupted(std::string_view id) const {
  auto found = find(id);
  if (!found) return found;
  const Run& run = **found;
  if (run.state() != RunState::interrupted)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "only an interrupted run is recovered",
                 .expected = "interrupted",
                 .got = std::string(to_string(run.state())),
                 .hint = resume_hint(run)});
  if (recovery_.is_settling(run.number()))
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "somebody is about to end this run"});
  return found;
}

void RunManager::preview(std::string_view id, Recovery choice, PreviewCallback on_preview) {
  const auto found = find_interrupted(id);
  if (!found) return on_preview(pass(found.error()));
  const StoredRun& run = (*found)->stored;
  recovery_.preview(run, choice, request_of(run), std::move(on_preview));
}

Result<CampaignRequest> RunManager::request_to_recover(std::string_view id) const {
  const auto found = find_interrupted(id);
  if (!found) return pass(found.error());
  return request_of((*found)->stored);
}

Result<RunView> RunManager::recover(std::string_view id, std::string_view by,
                                    const Checked& checked) {
  if (Status more = require_accepting(); !more) return pass(more.error());
  const auto found = find_interrupted(id);
  if (!found) return pass(found.error());
  Run& run = **found;
  if (!checked) return pass(checked.error());
  if (!run.counted) count_trials(run);  // its folder may be back
  StoredRun stored = run.to_store();
  if (Status there = is_where_it_was(stored); !there) return pass(there.error());
  stored.resume = true;
  const RunStateMachine queued{RunState::queued, RunStateMachine::Clock::max()};
  if (Status persisted = commit_transition(run, std::move(stored), queued, by); !persisted)
    return pass(persisted.error());
  use_plan(run, summarize(checked->plan));
  rig_.allow_resumed(run.number());
  notify(run, by);
  begin_next();
  return shown(run);
}

void RunManager::settle(std::string_view id, Recovery choice, std::string_view by,
                        SettleCallback on_done) {
  if (Status more = require_accepting(); !more) return on_done(pass(more.error()));
  const auto found = find_interrupted(id);
  if (!found) return on_done(pass(found.error()));
  if (Status here = store_.in_place(); !here) return on_done(pass(here.error()));
  Run& run = **found;
  recovery_.settle(run.stored, choice, by,
                   [this, &run, choice, by = std::string(by),
                    on_done = std::move(on_done)](const Result<CampaignSummary>& summary) {
                     on_settled(run, choice, by, summary, on_done);
                   });
}

// The rig is as the run left it: settling it has moved nothing. A folder that went away meanwhile
// had no campaign to settle.
void RunManager::on_settled(Run& run, Recovery choice, std::string_view by,
                            const Result<CampaignSummary>& summary, const SettleCallback& on_done) {
  StoredRun& stored = run.stored;
  if (!summary) return on_done(pass(summary.error(), stored.id()));
  if (Status here = store_.in_place(); !here) return on_done(pass(here.error()));
  stored.outcome = recipes::to_string(summary->outcome);
  stored.recovered = to_string(choice);
  stored.dataset_sha256 = summary->dataset_sha256;
  stored.error = format_error(summary->error);
  stored.dataset_error.clear();
  run.forget_folder();
  if (choice == Recovery::keep_partial) {
    run.trials_done = summary->trials_complete;
    run.trials_planned = summary->trials_planned;
  }
  apply(run, on_ended(), by,
        {.journal = {line(stored.id(), "recovered", by, {{"choice", to_string(choice)}})}});
  notify_ended(run);
  on_done(shown(run));
}

bool RunManager::can_be_resumed_externally(const Run& run) const {
  const StoredRun& stored = run.stored;
  return run.is_over() && !stored.has_all() && stored.recovered != to_string(Recovery::discard) &&
         executor_.run() != run.number() && !recovery_.is_settling(run.number());
}

void RunManager::scan_folders() {
  if (!recovery_.can_scan()) return;
  std::vector<FolderScan> scans;
  for (const auto& run : runs_)
    if (can_be_resumed_externally(*run)) scans.push_back({run->stored, run->certified_at});
  recovery_.scan(std::move(scans), [this](const FolderScan& scan) {
    Run* const found = numbered(scan.run.number);
    if (found == nullptr) return;
    Run& run = *found;
    if (!can_be_resumed_externally(run) || scan.run.dataset_sha256 != run.stored.dataset_sha256)
      return;  // it has changed meanwhile, so that nothing was learnt
    run.certified_at = scan.certified_at;
    if (scan.found == run.external_resume) return;
    run.external_resume = scan.found;
    notify(run, "auto:folder");
  });
}

}  // namespace weft::daemon::runs
