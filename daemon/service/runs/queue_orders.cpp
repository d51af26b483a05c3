// People's orders for the queue: each is one transaction and changes nothing if that fails.

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {

using nlohmann::json;

namespace {

bool has_ended_complete(const RunView& run) {
  return run.machine.state == RunState::ended && run.stored.outcome == "complete";
}

}  // namespace

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
  Status persisted = commit(
      std::move(queue), {.runs = {stored}, .journal = {state_line(stored, context_.utc_us(), by)}});
  if (!persisted) return persisted;
  run.stored = std::move(stored);
  run.machine = machine;
  prompts_.on_state(run.number(), machine.state);
  notify_queue(by);
  return {};
}

StoredRun RunManager::withdrawn(const Run& run) const {
  StoredRun stored = run.stored;
  stored.state = on_ended(stored.resume && !stored.had_ended).next.state;
  if (stored.resume) return stored;  // unchanged from before
  stored.outcome = "stopped";
  stored.cleanup = "skipped";
  stored.rig_fact = to_string(rig_.facts().fact);  // nothing was moved
  return stored;
}

Status RunManager::remove(std::string_view id, std::string_view by) {
  const auto found =
      find_queued(id, "run has already started", "End it with run.stop or run.abort");
  if (!found) return pass(found.error());
  Run& run = **found;
  StoredRun stored = withdrawn(run);
  const RunStateMachine next{stored.state, RunStateMachine::Clock::max()};
  if (Status persisted = commit_transition(run, std::move(stored), next, by); !persisted)
    return persisted;
  journal(id, "removed", by, json::object());
  rig_.end_override(run.number());
  notify(run, by);
  notify_ended(run);
  return {};
}

Status RunManager::clear_queue(std::string_view by) {
  RunQueue queue = queue_;
  const std::vector<RunQueue::Run> waiting = queue.runs();
  json names = json::array();
  for (const RunQueue::Run number : waiting) names.push_back(run_id(number));
  RunChange change{.journal = {line("", "queue_cleared", by, {{"runs", std::move(names)}})}};
  for (const RunQueue::Run number : waiting) {
    queue.remove(number);
    change.runs.push_back(withdrawn(*numbered(number)));
    change.journal.push_back(state_line(change.runs.back(), context_.utc_us(), by));
  }
  const std::vector<StoredRun> removed = change.runs;
  if (Status persisted = commit(std::move(queue), std::move(change)); !persisted) return persisted;
  rig_.end_override();
  for (const StoredRun& stored : removed) {
    Run& run = *numbered(stored.number);
    run.stored = stored;
    run.machine = {stored.state, RunStateMachine::Clock::max()};
    prompts_.on_state(run.number(), stored.state);
    notify(run, by);
    notify_ended(run);
  }
  notify_queue(by);
  return {};
}

Result<std::int64_t> RunManager::followed(std::int64_t run, const std::string& after) const {
  if (after.empty()) return 0;
  const auto found = find(after);
  if (!found) return pass(found.error());
  if ((*found)->is_over() && !has_ended_complete(**found) && !is_recoverable(**found))
    return fail({.code = Errc::wrong_state,
                 .where = "/params/after",
                 .what = "run to follow can no longer become complete",
                 .expected = "a queued, active, complete or recoverable run",
                 .got = after + ", " + (*found)->stored.outcome});
  // Each run follows at most one, so a chain that leads back to this run is a cycle. A complete run
  // no longer waits for another.
  for (const Run* next = *found; next != nullptr && !has_ended_complete(*next);
       next = run_before(*next))
    if (next->number() == run)
      return fail({.code = Errc::wrong_state,
                   .where = "/params/after",
                   .what = "run would wait for itself",
                   .expected = "a run that does not wait for this one",
                   .got = after});
  return (*found)->number();
}

const RunManager::Run* RunManager::run_before(const Run& run) const {
  if (run.stored.after == 0) return nullptr;
  const auto found = find(run_id(run.stored.after));
  return found ? *found : nullptr;
}

bool RunManager::is_ready(std::int64_t run) const {
  const Run* const waiting = numbered(run);
  if (waiting == nullptr || waiting->stored.after == 0) return waiting != nullptr;
  const Run* const first = run_before(*waiting);
  return first != nullptr && has_ended_complete(*first);
}

Status RunManager::edit(std::string_view id, const QueueEdit& wanted, std::string_view by) {
  const auto found = find_queued(id, "run not in the queue", "");
  if (!found) return pass(found.error());
  Run& run = **found;
  StoredRun stored = run.stored;
  if (stored.resume && (wanted.name || wanted.seed))
    return fail({.code = Errc::wrong_state,
                 .where = wanted.seed ? "/params/seed" : "/params/name",
                 .what = "name and seed of a resumed campaign cannot be changed",
                 .expected = "a run that resumes no campaign",
                 .got = run.stored.id()});
  if (wanted.name) {
    if (Status ok = check_name(*wanted.name); !ok) return ok;
    stored.name = *wanted.name;
    stored.folder = folder_for(stored);
  }
  if (wanted.seed) stored.seed = wanted.seed;
  if (wanted.keep_going) stored.keep_going = *wanted.keep_going;
  if (wanted.after) {
    const auto after = followed(run.number(), *wanted.after);
    if (!after) return pass(after.error());
    stored.after = *after;
  }
  RunQueue queue = queue_;
  queue.put(run.number(), wanted.place.value_or(queue.find_place(run.number())));
  json payload = submission_of(stored);
  payload["place"] = queue.find_place(run.number());
  RunChange change{.runs = {stored}, .journal = {line(id, "edited", by, payload)}};
  if (Status persisted = commit(std::move(queue), std::move(change)); !persisted) return persisted;
  run.stored = std::move(stored);
  if (wanted.seed) run.limits = {};  // another plan, reported by its thread
  notify(run, by);
  notify_queue(by);
  if (wanted.after) begin_next();  // it may be ready now
  return {};
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

}  // namespace weft::daemon::runs
