#pragma once
// Whether the rig may be moved, and why not, and how repeated stops are counted for the journal:
// values, with the time as an argument.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recipes/engine/engine.hpp"

namespace weft::daemon::runs {

/// "R-000318".
std::string run_id(std::int64_t number);

/// safe, holding (stopped where it was: the probe may be on the fabric) or unknown.
using recipes::RigFact;
/// The fact of that name; unknown for any other text.
RigFact rig_fact_of(std::string_view name);

/// Set by a halt, until a person resets it.
struct Latch {
  bool is_emergency = false;  ///< released by more than an operator's reset
  std::string why;            ///< who halted it and the reason
  friend bool operator==(const Latch&, const Latch&) = default;
};

/// A person keeps the rig from moving, over restarts too.
struct LockOut {
  std::string user, reason;
  std::int64_t since_us = 0;  ///< UTC
  friend bool operator==(const LockOut&, const LockOut&) = default;
};

/// What is kept of the rig: three facts that no other replaces.
struct RigFacts {
  RigFact fact = RigFact::safe;  ///< where the newest run left it
  std::string left_by = {};      ///< the run that left it so; empty where it is safe
  bool acknowledged = false;     ///< a person has looked at a rig that is not safe
  std::optional<Latch> latch = {};
  std::optional<LockOut> lock_out = {};
  friend bool operator==(const RigFacts&, const RigFacts&) = default;
};

class RigState {
 public:
  enum class Stop : std::uint8_t { halt, emergency };

  RigState() = default;
  explicit RigState(RigFacts facts) : facts_(std::move(facts)) {}
  explicit RigState(RigFact fact, std::string left_by = {})
      : RigState(RigFacts{fact, std::move(left_by)}) {}
  explicit RigState(Latch latch) : RigState(RigFacts{.latch = std::move(latch)}) {}

  [[nodiscard]] const RigFacts& facts() const { return facts_; }
  [[nodiscard]] bool is_latched() const { return facts_.latch.has_value(); }
  [[nodiscard]] bool is_emergency() const { return is_latched() && facts_.latch->is_emergency; }
  /// Latched, or not safe and nobody has looked.
  [[nodiscard]] bool needs_reset() const;
  /// Any motion, of a run or by hand.
  [[nodiscard]] bool can_move() const { return !needs_reset() && !facts_.lock_out; }
  /// Also the run that left the rig as it is, once a person resumes it.
  [[nodiscard]] bool can_move(std::int64_t run) const;

  /// Latches it. An emergency stop remains one through later halts. False: it was latched so.
  bool halt(Stop stop, std::string_view by, std::string_view reason);
  /// A person has looked at it: ends the latch; the fact stays what it is.
  void reset();
  /// A run that had the rig is over. A latch and a lock-out remain. False: nothing changes.
  bool on_ended(RigFact fact, std::string left_by);
  /// Errors: wrong_state, where another person has locked it out.
  Status lock(LockOut lock_out);
  /// `is_allowed_for_others`: of a role that may remove another person's. Errors: wrong_state;
  /// invalid_argument, another's without a reason.
  Status unlock(std::string_view user, bool is_allowed_for_others, std::string_view reason);
  /// A person resumes a run: it may move the rig that it left so, until the next change.
  void allow_resumed(std::int64_t run);
  /// No run may move such a rig any more, or `run` may not.
  void end_override() { resume_override_run_ = 0; }
  void end_override(std::int64_t run);

  /// The override is no part of it: it is neither kept nor shown.
  friend bool operator==(const RigState& a, const RigState& b) { return a.facts_ == b.facts_; }

 private:
  RigFacts facts_;
  std::int64_t resume_override_run_ = 0;  ///< 0: none
};

/// Stops that change nothing, said again and again: each counts, and a flood of them does not fill
/// the journal.
class RepeatedStops {
 public:
  using Clock = std::chrono::nanoseconds;  ///< monotonic, any origin
  /// So long repeats are counted before a line tells of them.
  static constexpr std::chrono::seconds window{10};
  /// Kinds of repeats that are told apart; more are counted together, as "auto:several".
  static constexpr std::size_t most_apart = 16;

  struct Stop {
    std::string kind, by, reason;
    bool operator==(const Stop&) const = default;
  };
  struct Counted {
    Stop stop;
    Clock since{};
    std::uint64_t times = 0;
  };

  /// Whether this one has a line of its own: it is news, or was not said within the window. Others
  /// are counted.
  bool is_journalled(const Stop& stop, bool is_news, Clock now);
  /// What was counted, where the window is over; each once. Without `now` all of it.
  std::vector<Counted> take(Clock now = Clock::max());

 private:
  std::vector<Counted> entries_;
};

}  // namespace weft::daemon::runs
