#pragma once
// What the operator steps of runs ask people for, and which of it is open: pure, with the time as
// an argument.

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/service/run_model/run_state.hpp"

namespace weft::daemon::runs {

/// What a person is asked for, or will be.
struct OperatorPrompt {
  recipes::StepPrompt prompt;
  std::string step = {};       ///< names what is asked now, "Q-12"; empty where it is not asked yet
  recipes::Ticket ticket = 0;  ///< what the engine needs with a confirmation; 0 likewise
  /// Since when it is asked, by the monotonic clock.
  std::optional<std::chrono::nanoseconds> at = {};
  /// The same, or when it will be asked as far as is known, by the machine's wall clock [UTC].
  std::optional<std::int64_t> at_us = {};
};

/// At most one prompt for each run, by its number.
class OperatorPrompts {
 public:
  /// `names_taken`: none of the names up to this one is given again.
  explicit OperatorPrompts(std::int64_t names_taken = 0) : names_taken_(names_taken) {}

  /// The plan of a run is known: what it asks for first, if anything.
  void on_plan(std::int64_t run, const std::optional<recipes::StepPrompt>& first);
  /// The engine of a run reports, which is in `state` from now on. The prompt that opens, if any.
  const OperatorPrompt* on_step(std::int64_t run, RunState state, const RunStatusUpdate& moment,
                                std::chrono::nanoseconds now);
  /// A run has changed to `state`: one that is on its way to its end needs no person.
  void on_state(std::int64_t run, RunState state);
  /// The open prompt, or the next; nothing without one.
  [[nodiscard]] const OperatorPrompt* find(std::int64_t run) const;
  [[nodiscard]] recipes::Ticket ticket(std::int64_t run) const;
  /// Errors: wrong_state, when `step` does not name the open prompt.
  [[nodiscard]] Status check(std::int64_t run, std::string_view step) const;

 private:
  std::map<std::int64_t, OperatorPrompt> entries_;
  std::int64_t names_taken_;
};

}  // namespace weft::daemon::runs
