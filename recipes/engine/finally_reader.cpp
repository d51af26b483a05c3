#include "recipes/engine/finally_reader.hpp"

#include <nlohmann/json.hpp>

#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

constexpr std::size_t most_last_steps = 16;
constexpr double longest_budget_s = 3600;

LastStep read_last_step(const json& value, const std::string& place, const RigLimits& limits,
                        Problems& problems) {
  ObjectReader reader(value, place, problems);
  const auto travel = [&](Axis axis) {
    const Range& range = limits.geometry.travel[index(axis)];
    return Bounds{range.min, range.max, "the stage's travel"};
  };
  LastStep step;
  switch (reader.choice("do", {"park", "wait"}).value_or(2)) {
    case 0:
      step = ParkStep{reader.quantity(quantities::x(), travel(Axis::x)).value_or(0),
                      reader.quantity(quantities::y(), travel(Axis::y)).value_or(0)};
      break;
    case 1:
      step = WaitStep{
          reader.quantity(quantities::duration(), {0.1, longest_budget_s, {}}).value_or(0)};
      break;
    default:
      return step;  // which members it should have nobody knows
  }
  reader.finish();
  return step;
}

std::vector<LastStep> read_last_steps(ObjectReader& finally, std::string_view cause,
                                      const RigLimits& limits, Problems& problems) {
  std::vector<LastStep> steps;
  const json* const list = finally.array(cause, Need::optional);
  if (list == nullptr) return steps;
  const std::string place = finally.at(cause);
  if (list->empty() || list->size() > most_last_steps) {
    problems.add({place, "the number of steps cannot be used",
                  "1 to " + std::to_string(most_last_steps), std::to_string(list->size()), ""});
    return steps;
  }
  for (std::size_t i = 0; i < list->size(); ++i)
    steps.push_back(read_last_step((*list)[i], child(place, i), limits, problems));
  return steps;
}

}  // namespace

Finally read_finally(ObjectReader& recipe, const RigLimits& limits, Problems& problems) {
  Finally out;
  const json* const value = recipe.object("finally", Need::optional);
  if (value == nullptr) return out;
  ObjectReader reader(*value, recipe.at("finally"), problems);
  out.on_success = read_last_steps(reader, "on_success", limits, problems);
  out.on_stop = read_last_steps(reader, "on_stop", limits, problems);
  out.on_fault = read_last_steps(reader, "on_fault", limits, problems);
  out.budget_s = reader.quantity(quantities::budget(), {1, longest_budget_s, {}}, Need::optional)
                     .value_or(out.budget_s);
  reader.finish();
  return out;
}

}  // namespace weft::recipes
