#pragma once
// Drives the engine by hand: keeps the state and the time, and looks up effects by type.

#include <algorithm>
#include <optional>
#include <vector>

#include "recipes/engine/engine.hpp"
#include "tests/unit/recipes/bench.hpp"

namespace weft::recipes::test {

template <class T>
std::vector<T> all_of(const std::vector<Effect>& effects) {
  std::vector<T> found;
  for (const Effect& effect : effects)
    if (const T* one = std::get_if<T>(&effect)) found.push_back(*one);
  return found;
}

template <class T>
std::optional<T> only(const std::vector<Effect>& effects) {
  const std::vector<T> found = all_of<T>(effects);
  return found.size() == 1 ? std::optional<T>(found.front()) : std::nullopt;
}

class Bench {
 public:
  explicit Bench(Plan the_plan) : plan(std::move(the_plan)) {}

  const std::vector<Effect>& send(const Event& event) {
    Transition t = step(plan, state, event, now);
    state = std::move(t.next);
    effects = std::move(t.effects);
    for (const Effect& effect : effects) remember(effect);
    return effects;
  }

  /// The answer with which the present step ends well; the timer for a recorded phase.
  Event good_answer() const {
    const Ticket t = state.ticket;
    switch (state.step) {
      case Step::ready:
        return Start{};
      case Step::awaiting_operator:
        return OperatorConfirmed{t};
      case Step::mounting:
        return Mounted{t};
      case Step::biasing:
        return Biased{t};
      case Step::approaching:
      case Step::seating:
        return ForceReached{t, touch_z_m};
      case Step::lifting:
        if (press_force_n() == 0) return MotionDone{t};
        return ForceReached{t, touch_z_m};
      case Step::releasing:
        return ForceReached{t, released_z_m};
      case Step::pressing:
        return ForceSettled{t};
      case Step::resting:
      case Step::holding:
      case Step::ending:
        return TimerExpired{t};
      case Step::held:
        return ResumeRequested{};
      default:
        return MotionDone{t};
    }
  }

  const std::vector<Effect>& advance() { return send(good_answer()); }

  void advance_to(Step wanted) {
    for (int i = 0; state.step != wanted; ++i) {
      WEFT_ASSERT(i < 1000);
      advance();
    }
  }

  double press_force_n() const {
    return plan.explorations[plan.trials[state.trial].exploration].step(Phase::press).force_n;
  }

  void finish() { advance_to(Step::done); }

  Plan plan;
  State state;
  TimePoint now{};
  double touch_z_m = 0.0985;
  double released_z_m = 0.0995;   ///< the force has fallen to about the weight
  std::vector<Effect> effects;    ///< of the last event
  std::vector<TrialDone> trials;  ///< so far
  std::optional<CampaignDone> end;
  Phase phase = Phase::none;  ///< the recorded phase
  bool force_loop = false;
  double commanded_z_m = 0;  ///< last target of z
  std::optional<ArmTimer> timer;

 private:
  void remember(const Effect& effect) {
    if (const auto* e = std::get_if<TrialDone>(&effect)) trials.push_back(*e);
    if (const auto* e = std::get_if<CampaignDone>(&effect)) end = *e;
    if (const auto* e = std::get_if<SetPhase>(&effect)) phase = e->phase;
    if (const auto* e = std::get_if<ArmTimer>(&effect)) timer = *e;
    if (std::holds_alternative<HoldForce>(effect)) force_loop = true;
    if (std::holds_alternative<ReleaseForce>(effect) || std::holds_alternative<StopMotion>(effect))
      force_loop = false;
    if (const auto* e = std::get_if<Descend>(&effect)) commanded_z_m = e->target_z_m;
    if (const auto* e = std::get_if<Ascend>(&effect)) commanded_z_m = e->target_z_m;
    if (const auto* e = std::get_if<MoveTo>(&effect))
      for (const AxisMove& m : e->moves)
        if (m.axis == Axis::z) commanded_z_m = m.target;
  }
};

}  // namespace weft::recipes::test
