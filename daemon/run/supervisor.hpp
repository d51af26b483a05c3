#pragma once
// Runs a plan on a bench: carries out the engine's effects and feeds the outcomes back. One scan
// cycle at a fixed rate reads the bench, looks at the guards, then updates the controller and
// writes commands.

#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "daemon/run/bench.hpp"
#include "daemon/run/trial_recording.hpp"
#include "recipes/control/force_loop.hpp"
#include "recipes/control/guard_watch.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {

/// Puts a fabric on the plate: a person's work on a real bench, the plant's on a simulated one.
/// Calls `done` once, at once or later, on the bench's loop.
using MountDone = std::function<void(Status)>;
using Mounter =
    std::function<void(std::string_view fabric, std::uint64_t patch_seed, MountDone done)>;

struct SupervisorHooks {
  Mounter mount;
  std::function<void(const recipes::TrialDone&, const ForceTally&)> trial_done;
};

/// Thread-bound to the bench's loop. The plan, bench and recording outlive it.
class Supervisor {
 public:
  Supervisor(const recipes::Plan& plan, Loop& loop, Bench& bench, TrialRecording& recording,
             SupervisorHooks hooks);
  ~Supervisor();

  /// The bench is up: begin with trial `first_trial`.
  void start(std::size_t first_trial = 0);
  /// Feeds an event from outside: StopRequested, AbortRequested, HaltRequested.
  void request(recipes::Event event);

  [[nodiscard]] const std::optional<recipes::CampaignDone>& result() const { return result_; }
  [[nodiscard]] const recipes::State& state() const { return state_; }

 private:
  // supervisor.cpp: events and effects
  void dispatch(recipes::Event event);
  void carry_out(const recipes::TrialBegin& effect);
  void carry_out(const recipes::MountFabric& effect);
  void carry_out(const recipes::MoveTo& effect);
  void carry_out(const recipes::BiasSensors& effect);
  void carry_out(const recipes::Descend& effect);
  void carry_out(const recipes::HoldForce& effect);
  void carry_out(const recipes::ReleaseForce& effect);
  void carry_out(const recipes::SetPhase& effect);
  void carry_out(const recipes::ArmTimer& effect);
  void carry_out(const recipes::StopMotion& effect);
  void carry_out(const recipes::TrialDone& effect);
  void carry_out(const recipes::CampaignDone& effect);

  // scan_cycle.cpp
  void cycle();
  bool guarded(Duration since_last);
  void trip(recipes::Event event);
  std::optional<recipes::GuardTrip> look_at_guards(Duration since_last);
  [[nodiscard]] recipes::WatchInput watched(const Snapshot& seen) const;
  void look_at_motion();
  void look_at_descent();
  void look_at_bias();
  void regulate(Duration since_last);
  void poll();

  // A servo command ends by itself after this time, whatever the rate of the cycle.
  static constexpr Duration servo_horizon = std::chrono::milliseconds(100);
  void drive(StageAxis axis, double velocity);
  std::uint32_t command(StageAxis axis, const Command& command);
  void stand_still(StageAxis axis);

  /// A motion command under way and the number that confirms it.
  struct Awaited {
    StageAxis axis;
    std::uint32_t move_id;
  };
  struct Motion {
    recipes::Ticket ticket;
    std::vector<Awaited> moves;
  };
  struct Biasing {
    recipes::Ticket ticket;
    TimePoint since;
    unsigned quiet_readings;
    WrenchSample sum;  ///< of the quiet readings
    std::optional<TimePoint> last_reading;
  };
  struct Regulation {
    recipes::HoldForce order;
    recipes::ForceLoopState loop;
    recipes::SettleDetector settle;
    bool settled = false;
  };

  const recipes::Plan* plan_;
  Loop* loop_;
  Bench* bench_;
  TrialRecording* recording_;
  SupervisorHooks hooks_;
  recipes::State state_;
  std::deque<recipes::Event> events_;
  bool dispatching_ = false;
  std::optional<recipes::CampaignDone> result_;

  recipes::GuardLimits guard_limits_;
  recipes::GuardWatch watch_;
  std::size_t trips_ = 0;
  recipes::ForceLoopConfig force_config_;
  Duration period_{};
  TimePoint last_cycle_;
  TimePoint cycle_due_;
  std::uint64_t cycles_ = 0;
  TimerId cycle_timer_ = 0;
  TimerId engine_timer_ = 0;
  std::optional<TimePoint> deadline_;  ///< of the step that the engine is in
  std::optional<Motion> motion_;
  std::optional<recipes::Descend> descent_;
  std::optional<Biasing> biasing_;
  std::optional<Regulation> regulation_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  ///< for a mount that ends late
};

}  // namespace weft::daemon
