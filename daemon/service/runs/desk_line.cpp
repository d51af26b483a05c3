// The line of runs that wait for the rig.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {

RunDesk::Run* RunDesk::numbered(std::int64_t number) const {
  const auto found = std::find_if(runs_.begin(), runs_.end(), [number](const auto& run) {
    return run->view.stored.number == number;
  });
  return found == runs_.end() ? nullptr : found->get();
}

// Of runs that waited before there was a line to keep them in, the oldest is the first.
void RunDesk::take_up_line() {
  if (auto kept = store_.line()) line_ = std::move(*kept);
  const auto waits = [this](std::int64_t number) {
    const Run* const run = numbered(number);
    return run != nullptr && run->state() == RunState::queued;
  };
  std::erase_if(line_.runs, [&](std::int64_t number) { return !waits(number); });
  for (const auto& run : runs_) {
    const std::int64_t number = run->view.stored.number;
    if (waits(number) && line_.place_of(number) == line_.runs.size()) line_.runs.push_back(number);
  }
  RunLine found = line_;
  if (!found.runs.empty() && !found.held()) found.held_by = after_restart;
  if (found.runs.empty() && found.held_by == after_restart) found.held_by.clear();
  line_is(std::move(found), after_restart);
}

Status RunDesk::line_becomes(RunLine next, const Wish& wish) {
  next.revision = line_.revision + 1;
  const Status kept = store_.together([&] {
    Status done = store_.keep(next);
    return done ? store_.journal(around_.utc_us(), wish.run, wish.kind, wish.by, wish.payload_json)
                : done;
  });
  if (!kept) return kept;
  line_kept_ = true;
  line_ = std::move(next);
  if (around_.lined) around_.lined(line_, wish.by);
  return {};
}

void RunDesk::line_is(RunLine next, std::string_view by) {
  next.revision = line_.revision + 1;
  line_ = std::move(next);
  keep_line();
  if (around_.lined) around_.lined(line_, by);
}

Status RunDesk::becomes(Run& run, StoredRun stored, const RunMachine& machine,
                        std::string_view by) {
  stored.state = machine.state;
  RunLine next = line_;
  ++next.revision;
  std::erase(next.runs, stored.number);
  if (machine.state == RunState::queued) next.put(stored.number, 0);
  const nlohmann::json payload{{"state", to_string(machine.state)}};
  const Status kept = store_.together([&] {
    Status done = store_.update(stored);
    if (done) done = store_.keep(next);
    return done ? store_.journal(around_.utc_us(), stored.id(), "state", by, payload.dump()) : done;
  });
  if (!kept) return kept;
  run.view.stored = std::move(stored);
  run.view.machine = machine;
  if (run.is_over()) run.view.attention.reset();
  run.kept = line_kept_ = true;
  line_ = std::move(next);
  if (around_.lined) around_.lined(line_, by);
  return {};
}

Status RunDesk::withdraw(std::string_view id, std::string_view by) {
  Run* run = find(id);
  if (run == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/params/run",
                 .what = "no such run",
                 .got = std::string(id)});
  if (run->state() != RunState::queued)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "the run has begun",
                 .expected = "queued",
                 .got = std::string(to_string(run->state())),
                 .hint = "run.stop or run.abort ends it"});
  StoredRun stored = run->view.stored;
  const bool goes_on = stored.resume;
  if (!goes_on) {
    stored.outcome = "stopped";
    stored.cleanup = "skipped";
    stored.rig_fact = to_string(standing_.fact);  // nothing was moved
  }
  if (Status kept = becomes(*run, std::move(stored), on_ended(goes_on).next, by); !kept)
    return kept;
  if (trusted_ == run->view.stored.id()) trusted_.clear();
  tell(*run, by);
  tell_end(*run);
  return {};
}

void RunDesk::hold_after(const Run& run, const Error& why) {
  if (line_.runs.empty() || line_.held()) return;
  RunLine next = line_;
  next.held_by = after_failure;
  const nlohmann::json payload{{"run", run.view.stored.id()}, {"error", to_string(why)}};
  note("", "queue_paused", after_failure,
       payload.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  line_is(std::move(next), after_failure);
}

Status RunDesk::move(std::string_view id, std::size_t place, std::string_view by) {
  const Run* const run = find(id);
  if (run == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/params/run",
                 .what = "no such run",
                 .got = std::string(id)});
  if (run->state() != RunState::queued)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "the run does not wait in line",
                 .expected = "queued",
                 .got = std::string(to_string(run->state()))});
  RunLine next = line_;
  next.put(run->view.stored.number, place);
  const nlohmann::json payload{{"place", next.place_of(run->view.stored.number)}};
  const Status kept = line_becomes(std::move(next), {id, "moved", by, payload.dump()});
  if (kept) begin_next();
  return kept;
}

Status RunDesk::hold_line(std::string_view by) {
  if (line_.held())
    return fail({.code = Errc::wrong_state,
                 .where = "queue",
                 .what = "the queue is paused already",
                 .got = line_.held_by});
  RunLine next = line_;
  next.held_by = by;
  return line_becomes(std::move(next), {"", "queue_paused", by});
}

Status RunDesk::start_line(std::string_view by) {
  if (Status more = takes_more(); !more) return more;
  if (!line_.held())
    return fail({.code = Errc::wrong_state, .where = "queue", .what = "the queue is not paused"});
  RunLine next = line_;
  next.held_by.clear();
  const Status kept = line_becomes(std::move(next), {"", "queue_started", by});
  if (kept) begin_next();
  return kept;
}

}  // namespace weft::daemon::control
