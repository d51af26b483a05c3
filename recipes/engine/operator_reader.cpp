// Reads the operator steps and the final steps of a recipe; declared in recipe_reader.hpp.

#include "protocols/base/closest.hpp"
#include "recipes/engine/recipe_reader.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

constexpr std::size_t most_operator_steps = 16;
constexpr std::size_t longest_request_bytes = 500;
constexpr double longest_work_s = 86'400;

/// The pattern of the schema in code: no control characters, braces only around the marks.
bool is_request(std::string_view text) {
  while (!text.empty()) {
    std::string_view mark = text.substr(0, 1);
    for (const std::string_view known : {fabric_mark, number_mark, piece_mark, mounting_mark})
      if (text.starts_with(known)) mark = known;
    const char first = text.front();
    const bool plain = static_cast<unsigned char>(first) >= ' ' && first != '{' && first != '}';
    if (mark.size() == 1 && !plain) return false;
    text.remove_prefix(mark.size());
  }
  return true;
}

std::string read_text(ObjectReader& reader, Problems& problems) {
  const std::string text = reader.text("text").value_or("-");
  if (text.empty() || text.size() > longest_request_bytes || !is_request(text))
    problems.add(
        {reader.at("text"), "text of the operator step invalid",
         "1 to " + std::to_string(longest_request_bytes) +
             " bytes on one line, braces only in \"{fabric}\", \"{number}\", \"{piece}\" and "
             "\"{mounting}\"",
         clipped(text), ""});
  return text;
}

std::optional<std::size_t> find_place(const json& value, const std::string& place,
                                      const std::vector<std::string>& known, Problems& problems) {
  const std::string name = value.is_string() ? value.get<std::string>() : "";
  const auto found = std::find(known.begin(), known.end(), name);
  if (!name.empty() && found != known.end()) return static_cast<std::size_t>(found - known.begin());
  const std::vector<std::string_view> names(known.begin(), known.end());
  problems.add({place, "fabric not in the recipe", "", brief(value), did_you_mean(name, names)});
  return std::nullopt;
}

void read_only_fabrics(ObjectReader& reader, const std::vector<std::string>& known,
                       OperatorStep& step, Problems& problems) {
  const json* list = reader.array("fabrics", Need::optional);
  if (list == nullptr) return;
  const std::string place = reader.at("fabrics");
  if (list->empty())
    return problems.add(
        {place, "list of fabrics empty", "at least one, or no \"fabrics\"", "0", ""});
  for (std::size_t i = 0; i < list->size(); ++i) {
    const auto fabric = find_place((*list)[i], child(place, i), known, problems);
    if (!fabric) continue;
    if (std::find(step.fabrics.begin(), step.fabrics.end(), *fabric) != step.fabrics.end())
      problems.add({child(place, i), "fabric listed twice", "", known[*fabric], ""});
    step.fabrics.push_back(*fabric);
  }
}

OperatorStep read_step(const json& value, const std::string& place,
                       const std::vector<std::string>& fabrics, Problems& problems) {
  ObjectReader reader(value, place, problems);
  OperatorStep step;
  const auto before = reader.choice("before", {"campaign", "fabric", "mounting"});
  step.before = static_cast<OperatorStep::Before>(before.value_or(0));
  if (before == 0)
    reader.explain("fabrics", "fabrics not allowed in a step before the campaign");
  else
    read_only_fabrics(reader, fabrics, step, problems);
  step.text = read_text(reader, problems);
  step.people_s = reader.quantity(quantities::people, {0, longest_work_s, {}}).value_or(0);
  reader.finish();
  return step;
}

constexpr std::size_t most_last_steps = 16;
constexpr double longest_budget_s = 3600;

/// Without a stage y keeps its position.
double read_park_y(ObjectReader& reader, const RigLimits& limits, const Bounds& travel) {
  const bool fixed = limits.geometry.is_fixed(Axis::y);
  return reader.quantity(quantities::y, travel, fixed ? Need::optional : Need::required)
      .value_or(fixed ? travel.min : 0);
}

LastStep read_last_step(const json& value, const std::string& place, const RigLimits& limits,
                        Problems& problems) {
  ObjectReader reader(value, place, problems);
  const auto travel = [&](Axis axis) {
    const Range& range = limits.geometry.travel[index(axis)];
    return Bounds{range.min, range.max, "the travel of the stage"};
  };
  LastStep step;
  switch (reader.choice("do", {"park", "wait"}).value_or(2)) {
    case 0:
      step = ParkStep{reader.quantity(quantities::x, travel(Axis::x)).value_or(0),
                      read_park_y(reader, limits, travel(Axis::y))};
      break;
    case 1:
      step =
          WaitStep{reader.quantity(quantities::duration, {0.1, longest_budget_s, {}}).value_or(0)};
      break;
    default:
      return step;  // its valid members are not known
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
    problems.add({place, "number of steps out of range", "1 to " + std::to_string(most_last_steps),
                  std::to_string(list->size()), ""});
    return steps;
  }
  for (std::size_t i = 0; i < list->size(); ++i)
    steps.push_back(read_last_step((*list)[i], child(place, i), limits, problems));
  return steps;
}

}  // namespace

void read_operator_steps(ObjectReader& recipe, StatedRecipe& stated, Problems& problems) {
  const json* list = recipe.array("operator_steps", Need::optional);
  if (list == nullptr) return;
  const std::string place = recipe.at("operator_steps");
  if (list->empty() || list->size() > most_operator_steps)
    return problems.add({place, "number of steps out of range",
                         "1 to " + std::to_string(most_operator_steps),
                         std::to_string(list->size()), ""});
  for (std::size_t i = 0; i < list->size(); ++i)
    stated.operator_steps.push_back(
        read_step((*list)[i], child(place, i), stated.fabrics, problems));
}

Finally read_finally(ObjectReader& recipe, const RigLimits& limits, Problems& problems) {
  Finally out;
  std::optional<ObjectReader> reader = recipe.section("finally");
  if (!reader) return out;
  out.on_success = read_last_steps(*reader, "on_success", limits, problems);
  out.on_stop = read_last_steps(*reader, "on_stop", limits, problems);
  out.on_fault = read_last_steps(*reader, "on_fault", limits, problems);
  reader->set(out.budget_s, quantities::budget, {1, longest_budget_s, {}});
  reader->finish();
  return out;
}

}  // namespace weft::recipes
