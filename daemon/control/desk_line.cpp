// The line of runs that wait for the rig.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/control/desk_run.hpp"

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
  static_cast<void>(line_becomes(std::move(found), after_restart));
}

Status RunDesk::line_becomes(RunLine next, std::string_view by) {
  next.revision = line_.revision + 1;
  Status kept = store_.keep(next);
  line_ = std::move(next);
  if (around_.lined) around_.lined(line_, by);
  return kept;
}

Status RunDesk::move(std::string_view id, std::size_t place, std::string_view by) {
  const Run* const run = find(id);
  if (run == nullptr)
    return fail(Errc::not_found, "no such run", "/params/run", {}, std::string(id));
  if (run->state() != RunState::queued)
    return fail(Errc::wrong_state, "the run does not wait in line", "/params/run", "queued",
                std::string(to_string(run->state())));
  RunLine next = line_;
  next.put(run->view.stored.number, place);
  const nlohmann::json payload{{"place", next.place_of(run->view.stored.number)}};
  static_cast<void>(store_.journal(around_.utc_us(), id, "moved", by, payload.dump()));
  Status kept = line_becomes(std::move(next), by);
  begin_next();
  return kept;
}

Status RunDesk::hold_line(std::string_view by) {
  if (line_.held())
    return fail(Errc::wrong_state, "the queue is paused already", "queue", {}, line_.held_by);
  RunLine next = line_;
  next.held_by = by;
  static_cast<void>(store_.journal(around_.utc_us(), "", "queue_paused", by));
  return line_becomes(std::move(next), by);
}

Status RunDesk::start_line(std::string_view by) {
  if (!line_.held()) return fail(Errc::wrong_state, "the queue is not paused", "queue");
  RunLine next = line_;
  next.held_by.clear();
  static_cast<void>(store_.journal(around_.utc_us(), "", "queue_started", by));
  Status kept = line_becomes(std::move(next), by);
  begin_next();
  return kept;
}

}  // namespace weft::daemon::control
