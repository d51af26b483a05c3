#include "daemon/service/runs/maintenance.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/loop/threads.hpp"
#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {

using nlohmann::json;

void MaintenanceExecutor::begin(const recipes::MaintenanceOrder& order, OnBegins on_begins,
                                OnEnded on_ended) {
  order_ = order;
  orders_.emplace();
  MaintenanceHooks hooks;
  hooks.orders = &*orders_;
  hooks.pace = context_.pace;
  hooks.place = context_.place.get();
  hooks.begins = [this, on_begins = std::move(on_begins)](const MaintenanceBegin& begin) {
    context_.post([on_begins, begin] { on_begins(begin); });
  };
  const MaintenanceRequest request{.order = order, .rig = context_.rig};
  thread_ = std::jthread([this, request, hooks, on_ended = std::move(on_ended)] {
    result_ = catch_as_error([&] { return context_.maintain(request, hooks); });
    give_back_free_memory();
    context_.post([this, on_ended] {
      thread_.join();
      order_.reset();
      on_ended(std::exchange(result_, {}));
    });
  });
}

void MaintenanceExecutor::give(const GivenOrder& order) {
  if (order_) orders_->give(order);
}

void MaintenanceExecutor::stop() {
  if (!thread_.joinable()) return;
  orders_->give({Order::abort, by_shutdown});
  thread_.join();
}

json joints_json(const recipes::Joints& joints) {
  json out = json::object();
  for (const recipes::Axis axis : recipes::all_axes)
    out[std::string(to_string(axis)) + (recipes::is_linear(axis) ? "_m" : "_rad")] = joints[axis];
  return out;
}

namespace {

json order_json(const recipes::MaintenanceOrder& order) {
  json out{{"order", to_string(order.kind)}};
  if (order.kind != recipes::MaintenanceKind::jog) return out;
  out["axis"] = to_string(order.axis);
  out[recipes::is_linear(order.axis) ? "distance_m" : "distance_rad"] = order.distance;
  return out;
}

/// Text of such a motion in `left_by`.
std::string format_maintenance(const recipes::MaintenanceOrder& order, std::string_view by) {
  return std::string(to_string(order.kind)) + " (" + std::string(by) + ")";
}

json begin_json(const recipes::MaintenanceOrder& order, const MaintenanceBegin& begin) {
  json out = order_json(order);
  out["from"] = joints_json(begin.from);
  out["relative"] = begin.is_relative;
  return out;
}

}  // namespace

json maintenance_json(const recipes::MaintenanceOrder& order, const MaintenanceSummary& summary) {
  json out = begin_json(order, summary.begin);
  out["to"] = joints_json(summary.to);
  out["outcome"] = recipes::to_string(summary.done.outcome);
  out["rig"] = recipes::to_string(summary.done.rig);
  if (summary.done.error) out["error"] = to_string(*summary.done.error);
  return out;
}

Status RunManager::require_movable() const {
  if (Status more = require_accepting(); !more) return more;
  if (context_.one_run)
    return fail({.code = Errc::wrong_state,
                 .where = "daemon",
                 .what = "motion not available in the daemon of a weft run",
                 .hint = "Wait until the run has ended, then start weftd"});
  if (const auto run = active())
    return fail({.code = Errc::wrong_state,
                 .where = *run,
                 .what = "run in progress",
                 .expected = "no run",
                 .hint = "Stop or abort the run first; an abort lifts the probe"});
  if (const auto& order = maintenance_.order())
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "another motion in progress",
                 .got = std::string(to_string(order->kind)),
                 .hint = "Wait until it ends, or stop it with rig.halt"});
  if (rig_.can_move()) return {};
  const RigFacts& facts = rig_.facts();
  return fail({.code = Errc::wrong_state,
               .where = "rig",
               .what = "motion not allowed",
               .expected = "a safe rig without latch and lock-out",
               .got = facts.latch      ? "latched by " + facts.latch->why
                      : facts.lock_out ? "locked out by " + facts.lock_out->user
                                       : std::string(to_string(facts.fact)),
               .hint = facts.lock_out && !facts.latch
                           ? "Ask that user or an engineer to run weft unlock"
                           : "Inspect the rig, then reset it with a reason"});
}

// A driver that hangs blocks its thread; after this time the daemon ends without it.
void RunManager::stop_maintenance(Order order, std::string_view by) {
  constexpr std::chrono::seconds patience{15};
  maintenance_.give({order, std::string(by)});
  if (maintenance_.order() && maintenance_deadline_ == Deadlines::Duration::max())
    maintenance_deadline_ = context_.now() + patience;
}

// The rig counts as unknown from before the motion until its end is recorded. A daemon that dies in
// between therefore reports unknown at its next start.
void RunManager::maintain(const recipes::MaintenanceOrder& order, std::string_view by,
                          MaintenanceCallback on_done) {
  Status can = recipes::check_order(order);
  if (can) can = require_movable();
  if (can) can = store_.in_place();
  const RigFacts before = rig_.facts();
  RigState moving = rig_;
  moving.on_ended(RigFact::unknown, format_maintenance(order, by));
  json payload = order_json(order);
  payload["state"] = "begun";
  if (can) can = store_.commit({.rig = moving, .journal = {line("", "maintenance", by, payload)}});
  if (!can) return on_done(pass(can.error()));
  rig_ = std::move(moving);
  const auto has_begun = std::make_shared<bool>(false);
  maintenance_.begin(
      order,
      [this, order, has_begun, by = std::string(by)](const MaintenanceBegin& begin) {
        *has_begun = true;
        json moved = begin_json(order, begin);
        moved["state"] = "moving";
        journal("", "maintenance", by, moved);
      },
      [this, order, before, has_begun, by = std::string(by),
       on_done = std::move(on_done)](const Result<MaintenanceSummary>& summary) {
        on_maintained(order, before, *has_begun, by, summary);
        on_done(summary);
      });
  notify_rig(by);
}

// A motion that did not start leaves the rig's facts unchanged. A person who moves the rig by hand
// also inspects it: once at rest it may be moved again, even with the probe down. A run submitted
// meanwhile does not start between two motions of that person.
void RunManager::on_maintained(const recipes::MaintenanceOrder& order, const RigFacts& before,
                               bool has_begun, std::string_view by,
                               const Result<MaintenanceSummary>& summary) {
  maintenance_deadline_ = Deadlines::Duration::max();
  RigFacts facts = rig_.facts();
  const RigFact lost = has_begun ? RigFact::unknown : before.fact;  // without a summary
  facts.fact = summary ? summary->done.rig : lost;
  facts.left_by = summary || has_begun ? format_maintenance(order, by) : before.left_by;
  facts.acknowledged = summary ? facts.fact == RigFact::holding && !facts.latch &&
                                     summary->done.outcome != recipes::Outcome::failed
                               : !has_begun && before.acknowledged;
  if (facts.fact == RigFact::safe) facts.left_by.clear();
  rig_ = RigState(std::move(facts));
  json payload = summary ? maintenance_json(order, *summary) : order_json(order);
  payload["state"] = "ended";
  if (!summary)
    payload.update(
        {{"outcome", "failed"}, {"rig", to_string(lost)}, {"error", to_string(summary.error())}});
  RunChange change{.rig = rig_, .journal = {line("", "maintenance", by, payload)}};
  pause_queue_for(after_maintenance, order_json(order), change);
  store_.persist(change);
  notify_rig(by);
  if (change.queue) notify_queue(by);
}

}  // namespace weft::daemon::runs
