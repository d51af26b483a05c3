#pragma once
// Whether the rig may be moved, and why not, and how repeated stops are counted for the journal:
// values, with the time as an argument.

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace weft::daemon::runs {

/// "R-000318".
std::string run_id(std::int64_t number);

class RigState {
 public:
  enum class Fact : std::uint8_t {
    safe,
    unknown,  ///< a run ended, or died, without knowing where it left the rig
    latched   ///< halted
  };
  /// An emergency stop is released by more than an operator's word.
  enum class Stop : std::uint8_t { halt, emergency };

  RigState() = default;
  explicit RigState(Fact fact, std::string why = {}, bool is_emergency = false)
      : fact_(fact), is_emergency_(is_emergency), why_(std::move(why)) {}

  [[nodiscard]] Fact fact() const { return fact_; }
  /// Who halted it and the reason, or the run that left it unknown.
  [[nodiscard]] const std::string& why() const { return why_; }
  [[nodiscard]] bool is_emergency() const { return is_emergency_; }
  [[nodiscard]] bool is_safe() const { return fact_ == Fact::safe; }
  [[nodiscard]] bool is_latched() const { return fact_ == Fact::latched; }
  /// A rig in an unknown state is moved only by the run that left it so, once a person resumes it.
  [[nodiscard]] bool can_move(std::int64_t run) const;

  /// Latches it. An emergency stop remains one through later halts. False: it was latched so.
  bool halt(Stop stop, std::string_view by, std::string_view reason);
  /// A run that had the rig is over. A latch remains. False: nothing changes.
  bool on_ended(bool is_safe, std::int64_t run);
  /// A person resumes a run: it may move the rig that it left unknown, until the next change.
  void allow_resumed(std::int64_t run);
  /// No run may move an unknown rig any more, or `run` may not.
  void end_override() { resume_override_run_ = 0; }
  void end_override(std::int64_t run);

  /// The override is no part of it: it is neither kept nor shown.
  friend bool operator==(const RigState& a, const RigState& b) {
    return a.fact_ == b.fact_ && a.why_ == b.why_ && a.is_emergency_ == b.is_emergency_;
  }

 private:
  Fact fact_ = Fact::safe;
  bool is_emergency_ = false;
  std::string why_;
  std::int64_t resume_override_run_ = 0;  ///< 0: none
};
std::string_view to_string(RigState::Fact fact);

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
