// What a daemon finds of one that died.

#include <filesystem>
#include <utility>

#include "daemon/campaign/resume.hpp"
#include "daemon/service/runs/run_store.hpp"

namespace weft::daemon::control {
namespace {

bool was_under_way(RunState state) {
  return state != RunState::queued && state != RunState::ended && state != RunState::interrupted;
}

/// Nothing was moved or recorded; what only concludes may have come to its end.
void cut_before_rig(StoredRun& run, const RigStanding& standing) {
  if (run.outcome.empty()) {
    run.outcome = "interrupted";
    run.cleanup = "skipped";
    run.trials_done = 0;
  }
  run.rig_fact = to_string(standing.fact);
  std::error_code unseen;
  if (!std::filesystem::exists(run.folder / campaign_file_name, unseen))
    return;  // it may come back
  const std::string certified = certified_dataset(run.folder);
  if (certified != run.dataset_sha256) run.dataset_error.clear();
  run.dataset_sha256 = certified;
}

void cut_on_rig(StoredRun& run) {
  if (run.state == RunState::arming && !run.resume)
    run.trials_done = 0;
  else
    run.trials_done.reset();  // more may have been recorded since
  run.outcome = "interrupted";
  run.cleanup = "skipped";
  run.rig_fact = "unknown";
  for (std::string* fact : {&run.error, &run.bench_outcome, &run.bench_error}) fact->clear();
  run.dataset_error.clear();
  run.dataset_sha256 = certified_dataset(run.folder);
}

}  // namespace

Status RunStore::take_stock() {
  auto runs = load();
  if (!runs) return pass(runs.error());
  const auto before = standing();
  if (!before) return pass(before.error());
  for (StoredRun& run : *runs) {
    if (!was_under_way(run.state)) continue;
    const bool took_rig = !std::exchange(run.rig_untaken, false);
    if (took_rig)
      cut_on_rig(run);
    else
      cut_before_rig(run, *before);
    run.state = RunState::interrupted;
    if (took_rig && before->fact != RigStanding::Fact::latched)
      if (Status ok = keep({RigStanding::Fact::unknown, run.id()}); !ok) return ok;
    if (Status ok = update(run); !ok) return ok;
  }
  return {};
}

}  // namespace weft::daemon::control
