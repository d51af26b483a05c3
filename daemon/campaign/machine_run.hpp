#pragma once
// The scan cycle around a machine without recording (alignment, maintenance). Each cycle checks the
// guards, then the orders in progress, and carries out the machine's effects.

#include <algorithm>
#include <optional>
#include <utility>
#include <variant>

#include "daemon/campaign/bench_actions.hpp"
#include "daemon/campaign/orders/run_orders.hpp"

namespace weft::daemon {

/// Thread-bound to the bench's loop. Plan and bench outlive it. Required beside `State`: step(plan,
/// state, event, now), is_retreating(state), zero_moves(state).
template <class Plan, class State, class Done>
class MachineRun {
 public:
  MachineRun(const Plan& plan, Loop& loop, Bench& bench)
      : plan_(&plan),
        loop_(&loop),
        bench_(&bench),
        actions_(plan.limits, loop, bench,
                 [this](recipes::Event event) { dispatch(std::move(event)); }),
        period_(from_seconds(1.0 / plan.limits.cycle_hz)) {}
  ~MachineRun() {
    loop_->cancel(cycle_timer_);
    loop_->cancel(step_timer_);
  }
  MachineRun(const MachineRun&) = delete;
  MachineRun& operator=(const MachineRun&) = delete;

  /// Call when the bench is up.
  void start() {
    last_cycle_ = loop_->now();
    cycle_due_ = last_cycle_ + period_;
    cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
    dispatch(recipes::Start{});
  }
  /// Accepts AbortRequested and HaltRequested.
  void request(recipes::Event event) { dispatch(std::move(event)); }

  [[nodiscard]] const std::optional<Done>& result() const { return result_; }
  [[nodiscard]] const State& state() const { return state_; }

 private:
  void cycle() {
    const TimePoint now = loop_->now();
    const Duration since_last = now - std::exchange(last_cycle_, now);
    ++cycles_;
    if (guarded(since_last)) actions_.check_all();
    if (result_) return;
    actions_.poll(cycles_);
    cycle_due_ = std::max(cycle_due_ + period_, now);
    cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
  }

  /// Whether this cycle may send commands, as in a campaign. After a trip, only the machine's
  /// answer is sent in this cycle. A retract in progress continues to its end.
  bool guarded(Duration since_last) {
    const bool retreating = is_retreating(state_);
    bool tripped = false;
    if (const Error* error = bench_->fault()) {
      tripped = true;
      dispatch(recipes::Fault{*error});
    }
    if (const auto guard = actions_.check_guards({deadline_, since_last, {}, zero_moves(state_)})) {
      tripped = true;
      dispatch(recipes::GuardTripped{*guard});
    }
    if (tripped && retreating) actions_.check_motion();
    return !tripped;
  }

  void dispatch(recipes::Event event) {
    events_.dispatch(std::move(event), [this](const recipes::Event& next) {
      auto transition = step(*plan_, state_, next, loop_->now());
      state_ = std::move(transition.next);
      for (const auto& effect : transition.effects)
        std::visit([this](const auto& e) { carry_out(e); }, effect);
    });
  }

  template <class Order>
  void carry_out(const Order& order) {
    actions_.begin(order);
  }
  void carry_out(const recipes::ArmTimer& timer) {
    loop_->cancel(step_timer_);
    deadline_ = timer.deadline;
    step_timer_ = loop_->at(timer.deadline, [this, ticket = timer.ticket] {
      dispatch(recipes::TimerExpired{ticket, actions_.still_awaited()});
    });
  }
  void carry_out(const recipes::StopMotion&) { actions_.stop(); }
  void carry_out(const Done& done) {
    loop_->cancel(cycle_timer_);
    loop_->cancel(step_timer_);
    result_ = done;
  }

  const Plan* plan_;
  Loop* loop_;
  Bench* bench_;
  BenchActions actions_;
  Duration period_;
  State state_;
  EventQueue<recipes::Event> events_;
  std::optional<Done> result_;
  std::uint64_t cycles_ = 0;
  TimePoint last_cycle_;
  TimePoint cycle_due_;
  TimerId cycle_timer_ = 0;
  TimerId step_timer_ = 0;
  std::optional<TimePoint> deadline_;
};

}  // namespace weft::daemon
