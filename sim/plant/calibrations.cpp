#include "sim/plant/calibrations.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "sim/plant/field_reader.hpp"

namespace weft::sim {
namespace {

using nlohmann::json;

bool is_parameter(const json& found) {
  const auto is_text = [&](const char* key) {
    return found.contains(key) && found[key].is_string();
  };
  return found.is_object() && is_text("name") && is_text("cloth") && is_text("standing") &&
         found.contains("value") && found["value"].is_number();
}

bool are_texts(const json& found) {
  return found.is_array() &&
         std::ranges::all_of(found, [](const json& one) { return one.is_string(); });
}

bool is_scale(const json& found) {
  return found.is_number() && found.get<double>() > 0;
}

bool are_parameters(const json& found) {
  return found.is_array() && std::ranges::all_of(found, is_parameter);
}

struct Field {
  const char* key;
  bool (*is_usable)(const json&);
  const char* expected;
};
constexpr Field fields[]{
    {"dataset_sha256", are_texts, "a list of texts"},
    {"counts_scale", is_scale, "a number above 0"},
    {"parameters", are_parameters,
     "a list of objects with name, cloth and standing (texts) and value (a number)"}};

}  // namespace

Status check_calibrations(const json& calibrations) {
  if (!calibrations.is_object())
    return parse_error("/calibrations",
                       {.what = "value has the wrong type", .expected = "an object"});
  for (const auto& [name, calibration] : calibrations.items()) {
    const std::string where = "/calibrations/" + name;
    if (!calibration.is_object())
      return parse_error(where, {.what = "value has the wrong type", .expected = "an object"});
    for (const Field& field : fields)
      if (calibration.contains(field.key) && !field.is_usable(calibration[field.key]))
        return parse_error(where + "/" + field.key,
                           {.what = "value invalid", .expected = field.expected});
  }
  return {};
}

}  // namespace weft::sim
