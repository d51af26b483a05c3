// What the desk writes down, and tries again where the disk refuses it.

#include <algorithm>

#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {

void RunDesk::keep(Run& run) {
  StoredRun& stored = run.view.stored;
  if (run.counted && run.view.trials_planned > 0) {
    stored.trials_done = static_cast<std::int64_t>(run.view.trials_done);
    stored.trials_planned = static_cast<std::int64_t>(run.view.trials_planned);
  }
  run.kept = store_.update(stored).has_value();
}

Status RunDesk::take_rig(Run& run) {
  run.took_rig = true;
  around_.post([this, &run] {
    if (run.orders->ends_run() || standing_.fact == RigStanding::Fact::latched)
      return give_leave(run, false);
    run.view.stored.rig_untaken = false;
    keep(run);
    run.view.stored.rig_untaken = !run.kept;
    give_leave(run, run.kept);
  });
  run.leave.wait(Run::Leave::awaited);
  if (run.leave == Run::Leave::given) return {};
  run.took_rig = false;
  if (run.orders->ends_run())
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "the run was told to end before it had the rig"});
  return fail({.code = Errc::io,
               .where = around_.data.string(),
               .what = "that the run takes the rig could not be written down, so it did not",
               .hint = "weft status says what keeps the daemon from it"});
}

void RunDesk::give_leave(Run& run, bool given) {
  run.leave = given ? Run::Leave::given : Run::Leave::refused;
  run.leave.notify_all();
}

void RunDesk::keep_standing() {
  standing_kept_ = store_.keep(standing_).has_value();
}

void RunDesk::keep_line() {
  line_kept_ = store_.keep(line_).has_value();
}

void RunDesk::note(std::string_view run, std::string_view kind, std::string_view by,
                   std::string payload_json) {
  notes_.push_back({0, around_.utc_us(), std::string(run), std::string(kind), std::string(by),
                    std::move(payload_json)});
  write_notes();
}

void RunDesk::write_notes() {
  while (!notes_.empty()) {
    const RunStore::Line& line = notes_.front();
    if (!store_.journal(line.utc_us, line.run, line.kind, line.by, line.payload_json)) return;
    notes_.pop_front();
  }
}

bool RunDesk::is_kept() const {
  return standing_kept_ && line_kept_ && notes_.empty() &&
         std::all_of(runs_.begin(), runs_.end(), [](const auto& run) { return run->kept; });
}

void RunDesk::keep_again() {
  if (!standing_kept_) keep_standing();
  if (!line_kept_) keep_line();
  for (const auto& run : runs_)
    if (!run->kept) keep(*run);
  write_notes();
}

}  // namespace weft::daemon::control
