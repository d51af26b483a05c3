#include "recipes/schema/parameters.hpp"

#include "protocols/base/closest.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

namespace weft::recipes {
namespace {

using nlohmann::json;

constexpr std::size_t most_parameters = 100;
constexpr std::size_t most_choices = 100;
constexpr std::size_t longest_text = 500;  // largest text value [bytes]; each reference copies it
constexpr const char* reference_key = "parameter";

/// Key endings and the units they stand for. A longer ending comes before one that it ends with.
constexpr std::array<std::pair<std::string_view, std::string_view>, 7> units{{{"_mm_s", "mm/s"},
                                                                              {"_mps", "m/s"},
                                                                              {"_mm", "mm"},
                                                                              {"_N", "N"},
                                                                              {"_n", "N"},
                                                                              {"_m", "m"},
                                                                              {"_s", "s"}}};

std::string_view unit_of(std::string_view key) {
  for (const auto& [end, unit] : units)
    if (key.ends_with(end)) return unit;
  return {};
}

enum class Type { number, integer, text, flag, choice };
const std::vector<std::string_view> type_names{"number", "integer", "text", "flag"};

struct Parameter {
  Type type = Type::number;
  std::vector<std::string> choices;
  std::string_view unit;
  Bounds bounds;
  json value;  ///< null: no value and no default
  bool is_used = false;
};
using Parameters = std::map<std::string, Parameter, std::less<>>;

std::string type_text(const Parameter& parameter) {
  switch (parameter.type) {
    case Type::number:
      return "a number";
    case Type::integer:
      return "a whole number";
    case Type::text:
      return "a text";
    case Type::flag:
      return "true or false";
    case Type::choice:
      break;
  }
  return one_of({parameter.choices.begin(), parameter.choices.end()});
}

bool is_whole(const json& value) {
  constexpr double most_exact = 9007199254740992.0;  // 2^53
  const double number = value.get<double>();
  return number == std::floor(number) && std::abs(number) <= most_exact;
}

bool has_type(const Parameter& parameter, const json& value) {
  switch (parameter.type) {
    case Type::number:
      return value.is_number();
    case Type::integer:
      return value.is_number() && is_whole(value);
    case Type::flag:
      return value.is_boolean();
    case Type::text:
      return value.is_string();
    case Type::choice:
      break;
  }
  return value.is_string() &&
         std::ranges::find(parameter.choices, value.get<std::string>()) != parameter.choices.end();
}

std::string unit_text(std::string_view unit) {
  return unit.empty() ? "no unit" : std::string(unit);
}

/// Gives equal numbers one spelling, so that equal recipes have equal digests. Null if refused.
json usable_value(const Parameter& parameter, const json& value, const std::string& place,
                  Problems& problems) {
  if (!has_type(parameter, value)) {
    problems.add({place, "value of the parameter has the wrong type", type_text(parameter),
                  brief(value), ""});
    return nullptr;
  }
  if (value.is_string() && value.get_ref<const std::string&>().size() > longest_text) {
    problems.add({place, "text of the parameter too long",
                  "at most " + std::to_string(longest_text) + " bytes", brief(value), ""});
    return nullptr;
  }
  if (!value.is_number()) return value;
  const double number = value.get<double>() + 0.0;  // -0.0 is 0.0
  if (number < parameter.bounds.min || number > parameter.bounds.max) {
    problems.add({place, "value of the parameter out of range",
                  range_text(parameter.bounds, {"", 1}), brief(value), ""});
    return nullptr;
  }
  return parameter.type == Type::integer ? json(static_cast<std::int64_t>(number)) : json(number);
}

void read_choices(const json& list, const std::string& place, Parameter& parameter,
                  Problems& problems) {
  parameter.type = Type::choice;
  if (list.empty() || list.size() > most_choices)
    problems.add({place, "number of choices out of range", "1 to " + std::to_string(most_choices),
                  std::to_string(list.size()), ""});
  for (const json& one : list) {
    if (one.is_string() && one.get_ref<const std::string&>().size() <= longest_text)
      parameter.choices.push_back(one.get<std::string>());
    else
      problems.add({place, "choice invalid",
                    "a text of at most " + std::to_string(longest_text) + " bytes", brief(one),
                    ""});
  }
}

void read_type(ObjectReader& reader, const json& declaration, Parameter& parameter,
               Problems& problems) {
  const auto type = declaration.find("type");
  if (type != declaration.end() && type->is_array()) {
    reader.leave("type");
    read_choices(*type, reader.at("type"), parameter, problems);
  } else if (const auto named = reader.choice("type", type_names)) {
    parameter.type = static_cast<Type>(*named);
  }
}

/// Only numbers have a unit and a range. The unit must match the ending of the name.
void read_numeric(const std::string& name, ObjectReader& reader, Parameter& parameter,
                  Problems& problems) {
  if (parameter.type != Type::number && parameter.type != Type::integer) {
    for (const char* key : {"unit", "min", "max"})
      reader.explain(key, "unit and range not allowed for this type");
    return;
  }
  std::vector<std::string_view> names;
  for (const auto& [end, unit] : units)
    if (std::ranges::find(names, unit) == names.end()) names.push_back(unit);
  if (const auto unit = reader.choice("unit", names, Need::optional)) parameter.unit = names[*unit];
  if (unit_of(name) != parameter.unit)
    problems.add({reader.at("unit"), "unit differs from the end of the parameter name",
                  unit_text(unit_of(name)), unit_text(parameter.unit),
                  "Use the same unit in both, such as \"force_N\" with \"unit\": \"N\""});
  reader.set(parameter.bounds.min, {"min", {{"min", 1}}}, {});
  reader.set(parameter.bounds.max, {"max", {{"max", 1}}}, {});
  if (parameter.bounds.min > parameter.bounds.max)
    problems.add(
        {reader.at("max"), "range empty", "at least min", json(parameter.bounds.max).dump(), ""});
}

void read_declaration(const std::string& name, const json& declaration, const std::string& place,
                      Parameters& parameters, Problems& problems) {
  if (!is_parameter_name(name))
    problems.add(
        {place, "parameter name invalid", std::string(parameter_name_rule), clipped(name), ""});
  Parameter& parameter = parameters[name];
  ObjectReader reader(declaration, place, problems);
  if (!declaration.is_object()) return;
  read_type(reader, declaration, parameter, problems);
  read_numeric(name, reader, parameter, problems);
  reader.text("description", Need::optional);
  reader.leave("default");
  if (const auto found = declaration.find("default"); found != declaration.end())
    parameter.value = usable_value(parameter, *found, reader.at("default"), problems);
  reader.finish();
}

Parameters read_declarations(const json& block, Problems& problems) {
  Parameters parameters;
  if (!block.is_object() || block.size() > most_parameters) {
    problems.add({"/parameters", "parameters invalid",
                  "an object of at most " + std::to_string(most_parameters) + " parameters",
                  brief(block), ""});
    return parameters;
  }
  for (const auto& [name, declaration] : block.items())
    read_declaration(name, declaration, child("/parameters", name), parameters, problems);
  return parameters;
}

void unknown_parameter(std::string place, const std::string& name, const Parameters& parameters,
                       Problems& problems) {
  std::vector<std::string_view> known;
  for (const auto& [each, parameter] : parameters) known.push_back(each);
  problems.add({std::move(place), "parameter not in the recipe",
                known.empty() ? "no parameters" : one_of(known), clipped(name),
                did_you_mean(name, known)});
}

void bind_values(std::string_view values_json, Parameters& parameters, Problems& problems) {
  if (values_json.empty()) return;
  json values;
  Problems of_text;
  if (!parse_json(values_json, {}, values, of_text)) {
    for (Diagnostic& one : of_text.take()) {
      one.pointer = "/parameters" + one.pointer;
      problems.add(std::move(one));
    }
    return;
  }
  if (!values.is_object())
    return problems.add({"/parameters", "values have the wrong type", "an object", brief(values),
                         "Write {\"NAME\": value}"});
  for (const auto& [name, value] : values.items()) {
    const std::string place = child("/parameters", name);
    const auto found = parameters.find(name);
    if (found == parameters.end())
      unknown_parameter(place, name, parameters, problems);
    else
      found->second.value = usable_value(found->second, value, place, problems);
  }
}

bool is_reference(const json& value) {
  return value.is_object() && value.size() == 1 && value.contains(reference_key) &&
         value[reference_key].is_string();
}

/// Replaces references with their values.
class Resolver {
 public:
  Resolver(Parameters& parameters, Problems& problems)
      : parameters_(parameters), problems_(problems) {}

  /// `key` is the key of the nearest enclosing member; elements of its list share its unit.
  void resolve(json& value, const std::string& place, std::string_view key) {
    if (is_reference(value)) return replace(value, place, key);
    if (value.is_object())
      for (const auto& [name, member] : value.items()) resolve(member, child(place, name), name);
    if (value.is_array())
      for (std::size_t i = 0; i < value.size(); ++i) resolve(value[i], child(place, i), key);
  }

 private:
  void replace(json& value, const std::string& place, std::string_view key) {
    const std::string name = value[reference_key].get<std::string>();
    const auto found = parameters_.find(name);
    if (found == parameters_.end()) return unknown_parameter(place, name, parameters_, problems_);
    Parameter& parameter = found->second;
    parameter.is_used = true;
    const bool is_number = parameter.type == Type::number || parameter.type == Type::integer;
    const std::string_view wanted = unit_of(key);
    if (is_number && !wanted.empty() && parameter.unit != wanted)
      problems_.add({place, "unit of parameter " + name + " differs from the key",
                     unit_text(wanted), unit_text(parameter.unit), ""});
    value = parameter.value;
  }

  Parameters& parameters_;
  Problems& problems_;
};

void check_bound(const Parameters& parameters, Problems& problems) {
  for (const auto& [name, parameter] : parameters) {
    const std::string place = child("/parameters", name);
    if (!parameter.is_used)
      problems.add({place, "parameter not used in the recipe",
                    "{\"parameter\": \"" + name + "\"} in place of a value", "", ""});
    else if (parameter.value.is_null())
      problems.add({place, "parameter without a value", type_text(parameter), "",
                    "Give it a value; it has no default"});
  }
}

}  // namespace

bool is_parameter_name(std::string_view text) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !text.empty() && text.size() <= 64 && is_letter(text.front()) &&
         std::ranges::all_of(
             text, [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

bool bind_parameters(json& document, std::string_view values_json, Problems& problems) {
  const auto block = document.is_object() ? document.find("parameters") : document.end();
  Parameters parameters;
  if (block == document.end()) {
    bind_values(values_json, parameters, problems);
    return false;
  }
  if (document.contains("bound_parameters"))
    problems.add({"/bound_parameters", "key not allowed in a recipe with parameters", "", "",
                  "Remove the key"});
  parameters = read_declarations(*block, problems);
  document.erase(block);
  if (!problems.empty())
    return true;  // a wrong declaration causes further errors, which are not reported
  bind_values(values_json, parameters, problems);
  if (!problems.empty()) return true;
  Resolver resolver(parameters, problems);  // members only: the recipe itself is no value
  for (auto& [key, value] : document.items()) resolver.resolve(value, child("", key), key);
  check_bound(parameters, problems);
  json& bound = document["bound_parameters"] = json::object();
  for (const auto& [name, parameter] : parameters) bound[name] = parameter.value;
  return true;
}

void read_bound_parameters(ObjectReader& recipe, Problems& problems) {
  const json* bound = recipe.object("bound_parameters", Need::optional);
  if (bound == nullptr) return;
  for (const auto& [name, value] : bound->items())
    if (!is_parameter_name(name) || !value.is_primitive() || value.is_null())
      problems.add({child(recipe.at("bound_parameters"), name), "resolved parameter invalid",
                    "a number, a text or a flag", brief(value), ""});
}

}  // namespace weft::recipes
