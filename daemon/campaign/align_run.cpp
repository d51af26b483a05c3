#include "daemon/campaign/align_run.hpp"

#include <utility>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/bench_check.hpp"

namespace weft::daemon {

Result<AlignSummary> run_alignment(const AlignRequest& request) {
  const auto opened = open_rig(request.rig, request.plugins);
  if (!opened) return pass(opened.error());
  const auto& [rig, limits] = *opened;
  const auto plan = recipes::plan_alignment(limits, request.settings);
  if (!plan) return pass(plan.error(), request.rig.string());
  auto session = open_session({rig, request.rig, limits, request.seed});
  if (!session) return pass(session.error());
  const auto stop_requested = [&] { return request.stop != nullptr && request.stop->load(); };
  const DeviceLog log((*session)->bench(), (*session)->loop(), request.device_log);
  if (Status up = bring_up(**session, stop_requested); !up) return pass(up.error());
  AlignRun run(*plan, (*session)->loop(), (*session)->bench());
  run.start();
  recipes::Ticket reported = 0;
  bool stopping = false;
  (*session)->run_until([&] {
    if (stop_requested() && !std::exchange(stopping, true)) run.request(recipes::AbortRequested{});
    if (request.moved_on && std::exchange(reported, run.state().ticket) != run.state().ticket)
      request.moved_on(run.state());
    return run.result().has_value();
  });
  if (!run.result())
    return fail({.code = Errc::timeout, .where = "bench", .what = "bench does not respond"});
  const auto ended = std::chrono::duration_cast<std::chrono::seconds>(utc_now());
  return AlignSummary{rig.name,      rig.bench,          *plan,
                      *run.result(), run.state().rounds, to_seconds((*session)->loop().now()),
                      ended.count()};
}

}  // namespace weft::daemon
