#pragma once
// What a recipe has done finally, by how the campaign ended.

#include "recipes/engine/engine.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::recipes {

bool is_empty(const Finally& finally);

/// In order; none where the recipe says nothing of such an end.
const std::vector<LastStep>& steps_after(const Finally& finally, Outcome campaign);

/// The moves of a park, none of a wait; z stays where it is.
std::vector<AxisMove> list_moves(const Plan& plan, const LastStep& step);

/// How long the step takes [s]: a wait exactly, a park at most.
double duration_s(const Plan& plan, const LastStep& step);

/// Warnings of lists whose waits alone leave none of the budget. How long a park takes depends on
/// where the stages stand.
std::vector<Diagnostic> warnings_about_budget(const Finally& finally);

/// What the budget left no time for.
Error budget_used_up(std::string place, double budget_s);

}  // namespace weft::recipes
