#include "daemon/campaign/maintenance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/machine_run.hpp"

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;
using MaintenanceRun =
    MachineRun<recipes::MaintenancePlan, recipes::MaintenanceState, recipes::MaintenanceDone>;

constexpr Duration force_time = 300ms;  ///< readings of this time show the force before the motion
constexpr Duration rest_time = 2s;      ///< time for stopped stages to come to rest

/// Carries out one order on an open bench.
class MaintenanceSession {
 public:
  MaintenanceSession(BenchSession& session, const MaintenanceHooks& hooks)
      : session_(session), hooks_(hooks), pace_(hooks.pace) {}

  Result<recipes::BenchFound> examine() {
    const auto stopped = [this] { return hooks_.orders != nullptr && hooks_.orders->ends_run(); };
    if (Status up = bring_up(session_, stopped, Homing::none); !up) return pass(up.error());
    Bench& bench = session_.bench();
    bench.begin_recent();
    wait(force_time, stopped);
    if (stopped())
      return fail(
          {.code = Errc::wrong_state, .where = "bench", .what = "stopped before the first move"});
    recipes::BenchFound found{.joints = bench.snapshot().joints()};
    for (std::size_t i = 0; i < recipes::axis_count; ++i)
      found.homed[i] = bench.snapshot().stage[i].homed;
    if (const WrenchTotal& total = bench.snapshot().wrench_recent; total.readings > 0) {
      const WrenchSample zero = total.mean();
      found.force_n = std::hypot(zero.force_n[0], zero.force_n[1], zero.force_n[2]);
      bench.set_zero(zero);
    }
    return found;
  }

  recipes::MaintenanceDone execute(const recipes::MaintenancePlan& plan) {
    MaintenanceRun run(plan, session_.loop(), session_.bench());
    take_orders(run);  // a halt may have come since the bench was checked
    if (!run.result()) run.start();
    session_.run_until([&] {
      throttle();
      take_orders(run);
      return run.result().has_value();
    });
    if (run.result()) return *run.result();
    return {
        .outcome = recipes::Outcome::failed,
        .rig = recipes::RigFact::unknown,
        .error = Error{.code = Errc::timeout, .where = "bench", .what = "bench does not respond"}};
  }

  /// Waits while stopped stages still brake. False: one did not come to rest.
  bool come_to_rest() {
    Bench& bench = session_.bench();
    const TimePoint since = session_.loop().now();
    poll();
    bool rests = false;
    wait(rest_time, [&] {
      const Snapshot& seen = bench.snapshot();
      for (std::size_t i = 0; i < recipes::axis_count; ++i)
        if (!seen.fixed[i] &&
            (!seen.stage_at[i] || *seen.stage_at[i] <= since || seen.stage[i].moving))
          return false;
      return rests = true;
    });
    session_.loop().cancel(poll_timer_);
    return rests;
  }
  [[nodiscard]] recipes::Joints joints() const { return session_.bench().snapshot().joints(); }

 private:
  static constexpr Duration poll_period = 20ms;

  void poll() {
    for (const StageAxis axis : recipes::all_axes)
      if (session_.bench().has_stage(axis))
        static_cast<void>(session_.bench().stage(axis).driver().command(PollCommand{}));
    poll_timer_ = session_.loop().after(poll_period, [this] { poll(); });
  }

  void wait(Duration longest, const std::function<bool()>& enough) {
    bool is_over = false;
    const TimerId timer = session_.loop().after(longest, [&is_over] { is_over = true; });
    session_.run_until([&] { return is_over || enough(); });
    session_.loop().cancel(timer);
  }

  void take_orders(MaintenanceRun& run) {
    if (hooks_.orders == nullptr) return;
    while (const auto given = hooks_.orders->take()) {
      if (given->order == Order::halt) session_.forbid_lift();
      if (given->order >= Order::stop) run.request(event_of(*given));
    }
  }

  // An order ends the wait.
  void throttle() {
    constexpr std::chrono::milliseconds shortest{1}, longest{100};
    if (hooks_.orders == nullptr || session_.real_time()) return;
    for (;;) {
      const auto ahead = pace_.ahead(session_.loop().now(), steady_wall_now());
      if (ahead < shortest) return;
      const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(ahead);
      if (hooks_.orders->wait(std::min(rest, longest))) return;
    }
  }

  BenchSession& session_;
  const MaintenanceHooks& hooks_;
  PaceKeeper pace_;
  TimerId poll_timer_ = 0;
};

}  // namespace

Result<MaintenanceSummary> run_maintenance(const MaintenanceRequest& request,
                                           const MaintenanceHooks& hooks) {
  if (Status ok = recipes::check_order(request.order); !ok) return pass(ok.error());
  const auto opened = open_rig(request.rig, request.plugins);
  if (!opened) return pass(opened.error());
  const auto& [rig, limits] = *opened;
  const auto session = open_session({.rig = rig,
                                     .rig_path = request.rig,
                                     .limits = limits,
                                     .place = hooks.place,
                                     .begins_there = true});
  if (!session) return pass(session.error());
  const DeviceLog log((*session)->bench(), (*session)->loop(), hooks.device_log);
  MaintenanceSession bench(**session, hooks);
  const auto found = bench.examine();
  if (!found) return pass(found.error());
  const auto plan = recipes::plan_maintenance(limits, request.order, *found);
  if (!plan) return pass(plan.error());
  MaintenanceSummary summary{.begin = {found->joints, plan->is_relative}};
  if (hooks.begins) hooks.begins(summary.begin);
  summary.done = bench.execute(*plan);
  const bool rests = bench.come_to_rest();
  summary.to = bench.joints();
  if (rests) return summary;
  summary.done.rig = recipes::RigFact::unknown;
  if (!summary.done.error)
    summary.done.error =
        Error{.code = Errc::timeout, .where = "bench", .what = "stages did not come to rest"};
  return summary;
}

}  // namespace weft::daemon
