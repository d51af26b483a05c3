// People's orders: for runs and their queue, for the rig, and for the recovery of runs.

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {

using nlohmann::json;

namespace {

/// True if the engine finishes the current repetition before it pauses.
bool finishes_first(const RunView& run, Order order) {
  const recipes::Step step = run.moment ? run.moment->step : recipes::Step::ready;
  return order == Order::pause ? step > recipes::Step::mounting : step == recipes::Step::retracting;
}

}  // namespace

Result<RunView> RunManager::order(std::string_view id, Order order, std::string_view by,
                                  std::string_view confirms) {
  const auto found = find(id);
  if (!found) return pass(found.error());
  Run& run = **found;
  const auto step = on_order(run.machine, run.limits, order, context_.now());
  if (!step) {
    Error refused = step.error();
    if (order == Order::resume && is_recoverable(run))
      refused.hint = "Resume it with run.recover: weft recover " + run.stored.id() + " resume";
    if (run.is_over() || run.state() >= RunState::finishing)
      refused = refuse_late(run, order, by, std::move(refused));
    return pass(std::move(refused), run.stored.id());
  }
  RunChange change;
  const bool is_pause = order == Order::pause || order == Order::pause_now;
  run.pause_ordered_by = is_pause ? by : "";
  const std::size_t finished = finishes_first(run, order) ? 1 : 0;
  if (is_pause && run.trials_done + finished >= run.trials_planned) carry_pause_over(run, change);
  if (order == Order::confirm) {
    if (Status ok = prompts_.check(run.number(), confirms); !ok) return pass(ok.error());
    journal(id, "confirmed", by, {{"step", confirms}});  // before the rig may move
  }
  apply(run, *step, by, std::move(change));
  return shown(run);
}

Status RunManager::check_order(std::string_view id, Order order, std::string_view confirms) const {
  const auto found = find(id);
  if (!found) return pass(found.error());
  const Run& run = **found;
  if (const auto step = on_order(run.machine, run.limits, order, context_.now()); !step)
    return pass(step.error());
  return order == Order::confirm ? prompts_.check(run.number(), confirms) : Status();
}

// A person who pauses, stops or aborts a run wants no motion now, even if the run ended just before
// the order.
Error RunManager::refuse_late(const Run& run, Order order, std::string_view by, Error refused) {
  const bool is_to_hold = order != Order::resume && order != Order::confirm;
  RunQueue next = queue_;
  if (!is_to_hold || next.runs().empty() || !next.pause(by)) return refused;
  const json why{{"run", run.stored.id()}, {"late", to_string(order)}};
  if (Status held = change_queue(std::move(next), line("", "queue_paused", by, why), by); !held)
    return held.error();
  refused.hint = std::string("The run ") + (run.is_over() ? "has ended" : "is ending") +
                 ", so this order paused the queue. Continue with weft queue start";
  return refused;
}

// First stops the motion, then writes to the disk.
void RunManager::halt(RigState::Stop stop, std::string_view by, std::string_view reason) {
  stop_maintenance(Order::halt, by);
  RunChange change;
  bool is_news = maintenance_.order().has_value();
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
  pause_queue_for(after_halt, reason.empty() ? json::object() : json{{"reason", reason}}, change);
  const json payload = reason.empty() ? json::object() : json{{"reason", reason}};
  if (repeated_stops_.is_journalled({kind, std::string(by), std::string(reason)}, is_news,
                                    context_.now()))
    change.journal.push_back(
        line(halted.empty() ? std::string() : halted.front()->stored.id(), kind, by, payload));
  if (!change.is_empty()) store_.persist(change);
  for (Run* const run : halted) notify(*run, by);
  if (change.queue) notify_queue(by);
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
  if (!rig_.needs_reset())
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "rig needs no reset",
                 .expected = "a rig that is latched or not safe",
                 .got = std::string(to_string(rig_.facts().fact))});
  if (reason.size() < 3)
    return fail({.code = Errc::invalid_argument,
                 .where = "/params/reason",
                 .what = "reason missing or too short",
                 .expected = "at least 3 characters",
                 .got = std::string(reason)});
  if (Status idle = require_idle(); !idle) return idle;
  journal_repeated(repeated_stops_.take());
  RigState next = rig_;
  next.reset();
  return change_rig(std::move(next), line("", "reset", by, {{"reason", reason}}), by);
}

Status RunManager::require_idle() const {
  if (maintenance_.order())
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "motion in progress",
                 .hint = "Wait until it ends, or stop it with rig.halt"});
  const auto run = active();
  if (!run) return {};
  return fail({.code = Errc::wrong_state,
               .where = *run,
               .what = "run in progress",
               .expected = "ended",
               .hint = "Wait until it ends; restart the daemon if it is unresponsive"});
}

// A change that lets the rig move again starts no run: a person resumes the queue.
Status RunManager::change_rig(RigState rig, JournalLine line, std::string_view by) {
  RunQueue queue = queue_;
  const bool pauses = !rig_.can_move() && rig.can_move() && queue.pause_automatically(after_reset);
  RunChange change{.rig = rig, .journal = {std::move(line)}};
  if (pauses) change.journal.push_back(this->line("", "queue_paused", after_reset));
  if (Status persisted = commit(std::move(queue), std::move(change)); !persisted) return persisted;
  rig_ = std::move(rig);
  notify_rig(by);
  if (pauses) notify_queue(by);
  return {};
}

Status RunManager::lock_out(const LockOut& lock, std::string_view by) {
  if (Status idle = require_idle(); !idle) return idle;
  RigState next = rig_;
  if (Status locked = next.lock(lock); !locked) return locked;
  return change_rig(std::move(next), line("", "locked", by, {{"reason", lock.reason}}), by);
}

Status RunManager::unlock(const UnlockRequest& wanted, std::string_view by) {
  RigState next = rig_;
  if (Status ok = next.unlock(wanted.user, wanted.is_allowed_for_others, wanted.reason); !ok)
    return ok;
  const json payload{{"reason", wanted.reason}, {"locked_by", rig_.facts().lock_out->user}};
  return change_rig(std::move(next), line("", "unlocked", by, payload), by);
}

void RunManager::inject_fault(FaultOrder order, FaultCallback on_done) {
  if (!executor_.run())
    return on_done(fail({.code = Errc::wrong_state,
                         .where = "/rig",
                         .what = "no run in progress to inject a fault into",
                         .hint = "Start a run, or put faults for a whole run into the rig file "
                                 "under simulation.faults"}));
  const json payload{{"fault", json::parse(order.json)}, {"ends", order.ends}};
  auto journalled = [this, id = run_id(*executor_.run()), by = order.by, payload,
                     on_done = std::move(on_done)](const Status& done) {
    if (done) journal(id, "fault", by, payload);
    on_done(done);
  };
  executor_.inject(std::move(order), std::move(journalled));
}

Result<RunManager::Run*> RunManager::find_recoverable(std::string_view id) const {
  auto found = find(id);
  if (!found) return found;
  const Run& run = **found;
  if (!is_recoverable(run))
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = run.is_over() ? "run has nothing left to recover" : "run has not ended",
                 .expected = "interrupted, or ended with trials left",
                 .got = std::string(to_string(run.state())) +
                        (run.is_over() ? ", " + run.stored.outcome : std::string())});
  if (executor_.run() == run.number())
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "run unresponsive, its thread has not ended",
                 .hint = "Restart the daemon, then recover the run"});
  std::error_code unseen;  // a missing folder is refused later, by its name
  const std::filesystem::path parent = run.stored.folder.parent_path();
  const bool is_ours =
      context_.one_run || std::filesystem::equivalent(parent, context_.data, unseen) || unseen;
  if (!is_ours)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "campaign of an imported run belongs to another daemon",
                 .expected = "a folder in " + context_.data.string(),
                 .got = run.stored.folder.string(),
                 .hint = "Recover it with its own daemon, or with weft run --resume"});
  if (recovery_.is_settling(run.number()))
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "another request is recovering this run",
                 .hint = "Wait for its end with run.wait"});
  return found;
}

void RunManager::preview(std::string_view id, Recovery choice, PreviewCallback on_preview) {
  const auto found = find_recoverable(id);
  if (!found) return on_preview(pass(found.error()));
  const StoredRun& run = (*found)->stored;
  recovery_.preview(run, choice, request_of(run), std::move(on_preview));
}

Result<CampaignRequest> RunManager::request_to_recover(std::string_view id) const {
  const auto found = find_recoverable(id);
  if (!found) return pass(found.error());
  return request_of((*found)->stored);
}

Result<RunView> RunManager::recover(std::string_view id, const RecoverRequest& wanted,
                                    const Checked& checked) {
  const std::string& by = wanted.by;
  if (Status more = require_accepting(); !more) return pass(more.error());
  const auto found = find_recoverable(id);
  if (!found) return pass(found.error());
  Run& run = **found;
  if (!checked) return pass(checked.error());
  if (!run.counted) count_trials(run);  // its folder may have reappeared
  StoredRun stored = run.to_store();
  if (Status there = is_where_it_was(stored); !there) return pass(there.error());
  stored.had_ended = run.state() == RunState::ended;
  stored.user = wanted.user;
  stored.resume = true;
  const RunStateMachine queued{RunState::queued, RunStateMachine::Clock::max()};
  if (Status persisted = commit_transition(run, std::move(stored), queued, by); !persisted)
    return pass(persisted.error());
  use_plan(run, summarize(checked->plan, runs_in_real_time(context_.rig)));
  run.moment.reset();  // from its previous execution
  run.vote.reset();
  run.last_rejection.clear();
  rig_.allow_resumed(run.number());
  notify(run, by);
  begin_next();
  return shown(run);
}

void RunManager::settle(std::string_view id, Recovery choice, std::string_view by,
                        SettleCallback on_done) {
  if (Status more = require_accepting(); !more) return on_done(pass(more.error()));
  const auto found = find_recoverable(id);
  if (!found) return on_done(pass(found.error()));
  if (Status here = store_.in_place(); !here) return on_done(pass(here.error()));
  Run& run = **found;
  if (choice == Recovery::keep_partial && !run.stored.dataset_sha256.empty())
    return on_done(fail({.code = Errc::wrong_state,
                         .where = "/params/choice",
                         .what = "complete trials of this run already saved as a data set",
                         .expected = "resume or discard",
                         .got = std::string(to_string(choice))}));
  recovery_.settle(run.stored, choice, by,
                   [this, &run, choice, by = std::string(by),
                    on_done = std::move(on_done)](const Result<CampaignSummary>& summary) {
                     on_settled(run, choice, by, summary, on_done);
                   });
}

// The rig is as the run left it, because recovery moves nothing. If the data folder is missing,
// there was no campaign to recover.
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
  RunChange change{
      .journal = {line(stored.id(), "recovered", by, {{"choice", to_string(choice)}})}};
  change.put(run.to_store());  // even if its state does not change
  apply(run, on_ended(), by, std::move(change));
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
      return;  // the run has changed meanwhile, so the result is outdated
    run.certified_at = scan.certified_at;
    if (scan.found == run.external_resume) return;
    run.external_resume = scan.found;
    notify(run, "auto:folder");
  });
}

}  // namespace weft::daemon::runs
