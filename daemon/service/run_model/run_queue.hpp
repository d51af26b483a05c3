#pragma once
// The queue of runs as a value: change a copy, commit it, then replace the original.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/run_model/rig_state.hpp"
#include "daemon/service/run_model/run_state.hpp"

namespace weft::daemon::runs {

/// Causes that pause the queue without a person's order. A person resumes it.
inline constexpr const char* after_restart = "auto:restart";
inline constexpr const char* after_stop = "auto:stopped";
inline constexpr const char* after_abort = "auto:aborted";
inline constexpr const char* after_failure = "auto:failed";
inline constexpr const char* after_interruption = "auto:interrupted";
inline constexpr const char* after_halt = "auto:halted";
inline constexpr const char* after_reset = "auto:reset";
inline constexpr const char* after_maintenance = "auto:maintenance";
inline constexpr const char* without_disk = "auto:disk";
inline constexpr const char* without_rig_file = "auto:rig_file";

/// Facts of an ended run that the queue needs.
struct EndedRun {
  std::string_view outcome;
  bool keep_going = false;    ///< requested: continue after a stop, an abort or a failure
  bool acquired_rig = false;  ///< otherwise keep_going does not apply
  bool is_disk_full = false;  ///< too full for the run's record
  bool is_interrupted = false;
  /// State that a person's order aimed at: finishing, aborting or halting. The run may have ended
  /// complete before the order reached it; the person still wants no motion.
  std::optional<RunState> ordered = {};
  bool was_given_up = false;  ///< its thread did not answer in time
};
/// Cause for which the queue pauses after this end. Empty if the next run may start: after a
/// complete run, or if keep_going covers the end.
std::string_view pause_cause_of(const EndedRun& run);

/// Each change increases the revision; a client names the revision that it has read.
class RunQueue {
 public:
  using Run = std::int64_t;  ///< the run's number
  RunQueue() = default;
  RunQueue(std::int64_t revision, std::string paused_by, std::vector<Run> runs)
      : revision_(revision), paused_by_(std::move(paused_by)), runs_(std::move(runs)) {}

  [[nodiscard]] std::int64_t revision() const { return revision_; }
  /// Cause of the pause, until a person resumes the queue; empty: not paused.
  [[nodiscard]] const std::string& paused_by() const { return paused_by_; }
  [[nodiscard]] bool is_paused() const { return !paused_by_.empty(); }
  [[nodiscard]] const std::vector<Run>& runs() const { return runs_; }  ///< the next one first
  /// Place from 0; the length of the queue if the run is not queued.
  [[nodiscard]] std::size_t find_place(Run run) const;

  /// Adds a run or moves it. A place past the end is the end.
  void put(Run run, std::size_t place);
  /// Also ends an automatic pause when the last run leaves. False: the run was not queued.
  bool remove(Run run);
  /// Errors: wrong_state, if it is paused already.
  Status pause(std::string_view by);
  /// Errors: wrong_state, if it is not paused.
  Status resume();
  /// For one of the causes above. False: it is empty or paused, and stays unchanged.
  bool pause_automatically(std::string_view cause);
  /// Call when the daemon starts. `waiting`: its queued runs, oldest first; some may be older than
  /// the stored queue.
  void on_restart(const std::vector<Run>& waiting);

  /// True if the run's predecessor has ended complete.
  using IsReady = std::function<bool(Run)>;
  /// The first run that is ready and that the rig's state allows, even if the queue is paused.
  [[nodiscard]] std::optional<Run> first_allowed(const RigState& rig,
                                                 const IsReady& is_ready) const;
  /// The run to start now, if any.
  [[nodiscard]] std::optional<Run> next(const RigState& rig, const IsReady& is_ready) const;
  friend bool operator==(const RunQueue&, const RunQueue&) = default;

 private:
  std::int64_t revision_ = 0;
  std::string paused_by_;
  std::vector<Run> runs_;
};

}  // namespace weft::daemon::runs
