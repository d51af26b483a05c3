#pragma once
// The operator prompts of runs, and which of them is open. Pure; time is an argument.

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/service/run_model/run_state.hpp"

namespace weft::daemon::runs {

/// An operator prompt, open or still to come.
struct OperatorPrompt {
  recipes::StepPrompt prompt;
  std::string step = {};       ///< name of the open prompt, "Q-12"; empty if not yet open
  recipes::Ticket ticket = 0;  ///< the engine needs it with a confirmation; 0 if not yet open
  /// When it opened, on the monotonic clock.
  std::optional<std::chrono::nanoseconds> at = {};
  /// The same, or the expected time if known, on the machine's wall clock [UTC].
  std::optional<std::int64_t> at_us = {};
};

/// At most one prompt per run, by the run's number.
class OperatorPrompts {
 public:
  /// `names_taken`: names up to this one are not given again.
  explicit OperatorPrompts(std::int64_t names_taken = 0) : names_taken_(names_taken) {}

  /// Call when a run's plan is known; `first` is its first prompt, if any.
  void on_plan(std::int64_t run, const std::optional<recipes::StepPrompt>& first);
  /// Call when a run's engine reports; `state` is the run's new state. Returns the prompt that
  /// opens, if any.
  const OperatorPrompt* on_step(std::int64_t run, RunState state, const RunStatusUpdate& moment,
                                std::chrono::nanoseconds now);
  /// Call when a run has changed to `state`; a run that is ending has no prompt.
  void on_state(std::int64_t run, RunState state);
  /// The open prompt or the next one; null without one.
  [[nodiscard]] const OperatorPrompt* find(std::int64_t run) const;
  [[nodiscard]] recipes::Ticket ticket(std::int64_t run) const;
  /// Errors: wrong_state, if `step` is not the open prompt.
  [[nodiscard]] Status check(std::int64_t run, std::string_view step) const;

 private:
  std::map<std::int64_t, OperatorPrompt> entries_;
  std::int64_t names_taken_;
};

}  // namespace weft::daemon::runs
