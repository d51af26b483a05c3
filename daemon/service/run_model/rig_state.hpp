#pragma once
// Whether the rig may be moved and why not, and the counting of repeated stops for the journal.
// Values; time is an argument.

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

/// safe, holding (stopped in place: the probe may be on the fabric) or unknown.
using recipes::RigFact;
/// The fact of that name; unknown for any other text.
RigFact rig_fact_of(std::string_view name);

/// Set by a halt until a person resets it.
struct Latch {
  bool is_emergency = false;  ///< an e-stop: an operator cannot reset it
  std::string why;            ///< author of the halt, and the reason
  friend bool operator==(const Latch&, const Latch&) = default;
};

/// A person's block on motion; kept over restarts.
struct LockOut {
  std::string user, reason;
  std::int64_t since_us = 0;  ///< UTC
  friend bool operator==(const LockOut&, const LockOut&) = default;
};

/// Stored facts of the rig; none replaces another.
struct RigFacts {
  RigFact fact = RigFact::safe;  ///< how the newest run left it
  std::string left_by = {};      ///< the run that left it so; empty if safe
  bool acknowledged = false;     ///< a person has inspected a rig that is not safe
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
  /// Latched, or not safe and not yet inspected.
  [[nodiscard]] bool needs_reset() const;
  /// Any motion, of a run or by hand.
  [[nodiscard]] bool can_move() const { return !needs_reset() && !facts_.lock_out; }
  /// As above; also for the run that left the rig so, once a person resumes it.
  [[nodiscard]] bool can_move(std::int64_t run) const;

  /// Latches the rig. An e-stop stays one through later halts. False: it was latched so already.
  bool halt(Stop stop, std::string_view by, std::string_view reason);
  /// Call when a person has inspected the rig: ends the latch; the fact remains.
  void reset();
  /// Call when a run that moved the rig has ended. A latch and a lock-out remain. False: no change.
  bool on_ended(RigFact fact, std::string left_by);
  /// Errors: wrong_state, if another person has locked it out.
  Status lock(LockOut lock_out);
  /// `is_allowed_for_others`: the role may remove another person's lock-out. Errors: wrong_state;
  /// invalid_argument, for another's lock-out without a reason.
  Status unlock(std::string_view user, bool is_allowed_for_others, std::string_view reason);
  /// Call when a person resumes a run: it may move the rig that it left so, until the next change.
  void allow_resumed(std::int64_t run);
  /// Ends that permission, of any run or of `run`.
  void end_override() { resume_override_run_ = 0; }
  void end_override(std::int64_t run);

  /// The permission is not compared: it is neither stored nor shown.
  friend bool operator==(const RigState& a, const RigState& b) { return a.facts_ == b.facts_; }

 private:
  RigFacts facts_;
  std::int64_t resume_override_run_ = 0;  ///< 0: none
};

/// Repeated stops that change nothing: each is counted, and a flood of them does not fill the
/// journal.
class RepeatedStops {
 public:
  using Clock = std::chrono::nanoseconds;  ///< monotonic, any origin
  /// Repeats are counted for this time before a journal line reports them.
  static constexpr std::chrono::seconds window{10};
  /// Kinds of repeats that are counted separately; further ones together, as "auto:several".
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

  /// True if this stop gets its own line: `is_news`, or the first within the window. Others are
  /// counted.
  bool is_journalled(const Stop& stop, bool is_news, Clock now);
  /// Returns and clears the counts of windows that have ended; without `now` all counts.
  std::vector<Counted> take(Clock now = Clock::max());

 private:
  std::vector<Counted> entries_;
};

}  // namespace weft::daemon::runs
