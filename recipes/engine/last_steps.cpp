#include "recipes/engine/last_steps.hpp"

#include <algorithm>
#include <utility>

#include "recipes/engine/motion.hpp"

namespace weft::recipes {

bool is_empty(const Finally& finally) {
  return finally.on_success.empty() && finally.on_stop.empty() && finally.on_fault.empty();
}

const std::vector<LastStep>& steps_after(const Finally& finally, Outcome campaign) {
  if (campaign == Outcome::complete) return finally.on_success;
  return campaign == Outcome::failed ? finally.on_fault : finally.on_stop;
}

std::vector<AxisMove> list_moves(const Plan& plan, const LastStep& step) {
  const auto* const park = std::get_if<ParkStep>(&step);
  if (park == nullptr) return {};
  const double speed = plan.approach.transfer_speed_mps;
  return {{Axis::x, park->x_m, speed}, {Axis::y, park->y_m, speed}};
}

double duration_s(const Plan& plan, const LastStep& step) {
  if (const auto* const wait = std::get_if<WaitStep>(&step)) return wait->duration_s;
  const double speed = plan.approach.transfer_speed_mps;
  return move_timeout_s(std::max(full_travel_s(plan.limits, Axis::x, speed),
                                 full_travel_s(plan.limits, Axis::y, speed)));
}

std::vector<Diagnostic> warnings_about_budget(const Finally& finally) {
  std::vector<Diagnostic> out;
  const auto check_steps = [&](const char* cause, const std::vector<LastStep>& steps) {
    double waits_s = 0;
    for (const LastStep& step : steps)
      if (const auto* const wait = std::get_if<WaitStep>(&step)) waits_s += wait->duration_s;
    if (waits_s >= finally.budget_s)
      out.push_back({child("/finally", cause),
                     "its waits leave nothing of the budget: what is not done by then is left out",
                     "less than " + std::to_string(finally.budget_s) + " s",
                     std::to_string(waits_s) + " s", "raise budget_s or shorten the waits"});
  };
  check_steps("on_success", finally.on_success);
  check_steps("on_stop", finally.on_stop);
  check_steps("on_fault", finally.on_fault);
  return out;
}

Error budget_used_up(std::string place, double budget_s) {
  return {.code = Errc::timeout,
          .where = std::move(place),
          .what = "what the recipe does finally took longer than its budget",
          .expected = std::to_string(budget_s) + " s",
          .hint = "The probe is up; a larger finally.budget_s leaves time for the rest"};
}

}  // namespace weft::recipes
