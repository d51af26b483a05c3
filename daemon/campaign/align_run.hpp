#pragma once
// Runs an alignment on a bench: the scan cycle around recipes/alignment, and all of it from a rig
// file to what was found.

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>

#include "daemon/campaign/bench_actions.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/campaign/trial_recording.hpp"
#include "recipes/alignment/alignment.hpp"

namespace weft::daemon {

/// Thread-bound to the bench's loop. Plan and bench outlive it.
class AlignRun {
 public:
  AlignRun(const recipes::AlignPlan& plan, Loop& loop, Bench& bench);
  ~AlignRun();

  /// The bench is up.
  void start();
  /// AbortRequested, HaltRequested.
  void request(recipes::Event event) { dispatch(std::move(event)); }

  [[nodiscard]] const std::optional<recipes::AlignDone>& result() const { return result_; }
  [[nodiscard]] const recipes::AlignState& state() const { return state_; }

 private:
  void cycle();
  bool guarded(Duration since_last);
  void dispatch(recipes::Event event);
  template <class Order>
  void carry_out(const Order& order) {
    actions_.begin(order);
  }
  void carry_out(const recipes::ArmTimer& timer);
  void carry_out(const recipes::StopMotion&) { actions_.stop(); }
  void carry_out(const recipes::AlignDone& done);

  const recipes::AlignPlan* plan_;
  Loop* loop_;
  Bench* bench_;
  BenchActions actions_;
  Duration period_;
  recipes::AlignState state_;
  EventQueue<recipes::Event> events_;
  std::optional<recipes::AlignDone> result_;
  std::uint64_t cycles_ = 0;
  TimePoint last_cycle_;
  TimePoint cycle_due_;
  TimerId cycle_timer_ = 0;
  TimerId step_timer_ = 0;
  std::optional<TimePoint> deadline_;
};

struct AlignRequest {
  std::filesystem::path rig;
  recipes::AlignSettings settings;
  std::uint64_t seed = 1;  ///< of a simulated bench's sensors
  PluginSettings plugins = {};
  std::function<void(const DeviceLogEntry&)> device_log = {};
  std::function<void(const recipes::AlignState&)> moved_on = {};  ///< after each step
  const std::atomic<bool>* stop = nullptr;                        ///< set: abort, the probe up
};

struct AlignSummary {
  std::string rig_name;
  BenchKind bench = BenchKind::unknown;  ///< of what was touched
  recipes::AlignPlan plan;
  recipes::AlignDone done;
  std::vector<recipes::TiltFound> rounds;  ///< the first is the tilt before, the last after
  double bench_s = 0;                      ///< of the bench's own time
  std::int64_t measured_unix_s = 0;        ///< when it ended
};

/// Brings the bench up, aligns, and leaves the rotary stages where they are and the probe up. An
/// alignment that did not succeed is a summary with its error; errors are what kept it from
/// beginning.
Result<AlignSummary> run_alignment(const AlignRequest& request);

}  // namespace weft::daemon
