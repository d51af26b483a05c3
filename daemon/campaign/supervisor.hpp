#pragma once
// Runs a plan on a bench: carries out the engine's effects and reports their outcomes to it. One
// scan cycle at a fixed rate reads the bench and checks the guards. Then it updates the controller
// and sends commands.

#include <functional>
#include <memory>
#include <optional>

#include "daemon/campaign/bench_actions.hpp"
#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/campaign/trial_recording.hpp"
#include "recipes/control/force_latency.hpp"
#include "recipes/control/force_loop.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {

/// Mounts a piece of a fabric on the plate: by a person on a real bench, by the plant on a
/// simulated one. Calls `done` once, at once or later, on the bench's loop.
using MountDone = std::function<void(Status)>;
using Mounter = std::function<void(const recipes::MountFabric& order, MountDone done)>;

struct SupervisorHooks {
  Mounter mount;
  std::function<void(const recipes::TrialDone&, const ForceTally&)> trial_done;
  std::function<void(std::size_t trial)> trial_begun = {};
  /// Every sample of the sensors with its phase.
  std::function<void(const Sample&, Phase)> sensed = {};
  /// Called once per cycle during a stroke: true ends it early.
  std::function<bool()> slid_enough = {};
};

/// Thread-bound to the bench's loop. The plan, bench and recording outlive it.
class Supervisor {
 public:
  Supervisor(const recipes::Plan& plan, Loop& loop, Bench& bench, TrialRecording& recording,
             SupervisorHooks hooks);
  ~Supervisor();

  /// Call when the bench is up: begins or resumes.
  void start(recipes::Start from = {});
  /// Feeds an event from outside, such as StopRequested, AbortRequested or HaltRequested.
  void request(recipes::Event event);

  [[nodiscard]] const std::optional<recipes::CampaignDone>& result() const { return result_; }
  [[nodiscard]] const recipes::State& state() const { return state_; }
  /// The open operator prompt; null if there is none.
  [[nodiscard]] const recipes::PromptOperator* requested() const;

 private:
  // events and effects
  void dispatch(recipes::Event event);
  template <class Effect>
  requires requires(BenchActions& actions, const Effect& effect) { actions.begin(effect); }
  void carry_out(const Effect& effect) { actions_.begin(effect); }
  void carry_out(const recipes::PromptOperator& effect);
  void carry_out(const recipes::TrialBegin& effect);
  void carry_out(const recipes::MountFabric& effect);
  void carry_out(const recipes::HoldForce& effect);
  void carry_out(const recipes::ReleaseForce& effect);
  void carry_out(const recipes::SetPhase& effect);
  void carry_out(const recipes::ArmTimer& effect);
  void carry_out(const recipes::StopMotion& effect);
  void carry_out(const recipes::TrialDone& effect);
  void carry_out(const recipes::CampaignDone& effect);

  // the scan cycle
  void cycle();
  bool guarded(Duration since_last);
  void trip(recipes::Event event);
  [[nodiscard]] GuardContext guard_context(Duration since_last) const;
  void regulate(Duration since_last);
  /// The condition that the engine's step still waits for, as BenchActions::still_awaited(). If a
  /// press does not reach its force: the reason.
  [[nodiscard]] std::optional<Error> still_awaited() const;

  struct Regulation {
    recipes::HoldForce order;
    recipes::ForceLoopState loop;
    recipes::SettleDetector settle;
    double force_n = 0;  ///< of the last cycle with a new reading
    recipes::ForceLatency latency;
    bool settled = false;
  };

  const recipes::Plan* plan_;
  Loop* loop_;
  Bench* bench_;
  TrialRecording* recording_;
  SupervisorHooks hooks_;
  recipes::State state_;
  EventQueue<recipes::Event> events_;
  recipes::PromptOperator requested_;
  std::optional<recipes::CampaignDone> result_;

  BenchActions actions_;
  std::size_t trips_ = 0;
  recipes::ForceLoopConfig force_config_;
  Duration period_{};
  TimePoint last_cycle_;
  TimePoint cycle_due_;
  std::uint64_t cycles_ = 0;
  TimerId cycle_timer_ = 0;
  TimerId engine_timer_ = 0;
  std::optional<TimePoint> deadline_;  ///< of the engine's current step
  std::optional<Regulation> regulation_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  ///< for a mount that ends late
};

}  // namespace weft::daemon
