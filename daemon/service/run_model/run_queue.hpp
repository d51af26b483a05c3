#pragma once
// The runs that wait for the rig, as a value: change a copy, commit it, then replace the original.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/run_model/rig_state.hpp"
#include "daemon/service/run_model/run_state.hpp"

namespace weft::daemon::runs {

/// What pauses the queue without a person's order. A person resumes it.
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

/// What the queue has to know of a run that is over.
struct EndedRun {
  std::string_view outcome;
  bool keep_going = false;  ///< its request: the queue goes on after a stop, an abort or a failure
  bool acquired_rig = false;  ///< else keep_going does not apply
  bool is_disk_full = false;  ///< the disk was too full for its record
  bool is_interrupted = false;
  /// What it was on its way to by a person's order: finishing, aborting or halting. It may have
  /// ended complete before the order reached it: that person wants no motion all the same.
  std::optional<RunState> ordered = {};
  bool was_given_up = false;  ///< its thread did not answer for a while
};
/// Why nothing begins after this end; empty where the next run may begin: after a complete run, or
/// where keep_going covers the end.
std::string_view pause_cause_of(const EndedRun& run);

/// Each change makes another revision: a client that changes what it has read names that revision.
class RunQueue {
 public:
  using Run = std::int64_t;  ///< its number
  RunQueue() = default;
  RunQueue(std::int64_t revision, std::string paused_by, std::vector<Run> runs)
      : revision_(revision), paused_by_(std::move(paused_by)), runs_(std::move(runs)) {}

  [[nodiscard]] std::int64_t revision() const { return revision_; }
  /// Nothing begins until a person resumes the queue; empty: it is not paused.
  [[nodiscard]] const std::string& paused_by() const { return paused_by_; }
  [[nodiscard]] bool is_paused() const { return !paused_by_.empty(); }
  [[nodiscard]] const std::vector<Run>& runs() const { return runs_; }  ///< the next first
  /// From 0; the length of the queue for a run that does not wait.
  [[nodiscard]] std::size_t find_place(Run run) const;

  /// Adds a run or moves it. A place past the end is the end.
  void put(Run run, std::size_t place);
  /// Lifts an automatic pause with the last run. False: it did not wait.
  bool remove(Run run);
  /// Errors: wrong_state, when it is paused already.
  Status pause(std::string_view by);
  /// Errors: wrong_state, when it is not paused.
  Status resume();
  /// For one of the causes above. False: it is empty or paused, and nothing changes.
  bool pause_automatically(std::string_view cause);
  /// A daemon starts. `waiting`: its runs that wait, the oldest first; some may be from before the
  /// queue was kept.
  void on_restart(const std::vector<Run>& waiting);

  /// Whether the run that one is to follow has ended complete.
  using IsReady = std::function<bool(Run)>;
  /// The first run that the state of the rig allows and that is ready, paused or not.
  [[nodiscard]] std::optional<Run> first_allowed(const RigState& rig,
                                                 const IsReady& is_ready) const;
  /// The run to begin now, if any.
  [[nodiscard]] std::optional<Run> next(const RigState& rig, const IsReady& is_ready) const;
  friend bool operator==(const RunQueue&, const RunQueue&) = default;

 private:
  std::int64_t revision_ = 0;
  std::string paused_by_;
  std::vector<Run> runs_;
};

}  // namespace weft::daemon::runs
