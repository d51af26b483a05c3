// The shipped JSON Schema, for editors, must accept the same recipes as the parser. valijson
// validates.

// At -O3 g++ 12 assumes that valijson's std::string copies may be as long as half the address
// space.
#pragma GCC diagnostic ignored "-Wstringop-overflow"
#pragma GCC diagnostic ignored "-Warray-bounds"

#include <catch2/catch.hpp>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "tests/unit/recipes/bench.hpp"

namespace schema_test {

using namespace weft::recipes;
using nlohmann::json;
using test::small_recipe;
using test::small_with;
using test::source_file;

namespace {

/// The validator supports draft 7, the schema is 2020-12: of the changed keywords it uses only
/// those for lists with one schema for each place.
json as_draft_7(json schema) {
  if (schema.is_object() && schema.contains("prefixItems")) {
    if (schema.contains("items")) schema["additionalItems"] = schema["items"];
    schema["items"] = schema["prefixItems"];
    schema.erase("prefixItems");
  }
  if (schema.is_structured())
    for (json& part : schema) part = as_draft_7(std::move(part));
  return schema;
}

bool schema_accepts(const std::string& recipe) {
  using Adapter = valijson::adapters::NlohmannJsonAdapter;
  static const json document =
      as_draft_7(json::parse(source_file("recipes/schema/recipe.schema.json")));
  valijson::Schema schema;
  valijson::SchemaParser(valijson::SchemaParser::kDraft7).populateSchema(Adapter(document), schema);
  const json value = json::parse(recipe);
  return valijson::Validator().validate(schema, Adapter(value), nullptr);
}

bool parser_accepts(const std::string& recipe, const RigLimits& limits = test::limits()) {
  return check_recipe(recipe, limits).plan.has_value();
}

struct Case {
  const char* from;
  const char* to;
  bool good;
};

}  // namespace

TEST_CASE("The library's recipes pass schema and parser") {
  for (const char* name : {"m1", "m2", "m3-diagonal", "khan2016", "khan2016-patches",
                           "khan2016-pieces", "vibro-slide", "vibrotactile", "pilot-force-speed"}) {
    const std::string recipe = source_file("recipes/library/" + std::string(name) + ".json");
    INFO(name);
    RigLimits has_vibration = test::limits();
    has_vibration.sound_rate_hz = 8000;
    has_vibration.force_cap_n = 15;  // like sim/rigs/pilot17.json with its light probe
    has_vibration.probe_weight_n = 0.8;
    CHECK(schema_accepts(recipe));
    CHECK(parser_accepts(recipe, has_vibration));
  }
}

TEST_CASE("The recipe of 118 textures passes schema and parser on its rig") {
  const std::string recipe = source_file("recipes/library/textures118.json");
  const auto limits = parse_rig_limits(source_file("sim/rigs/textures118.json"));
  REQUIRE(limits.has_value());
  CHECK(schema_accepts(recipe));
  CHECK(parser_accepts(recipe, *limits));
}

TEST_CASE("Schema and parser agree on what does not depend on a rig") {
  const char* const reps = "\"repetitions\": 2";
  const std::vector<Case> cases{
      {reps, "\"repetitions\": 2", true},
      {reps, "\"repetitions\": 1", true},
      {reps, "\"repetitions\": 0", false},
      {reps, "\"repetitions\": -1", false},
      {reps, "\"repetitions\": 2.5", false},
      {reps, "\"repetitions\": 100001", false},
      {reps, "\"repetitions\": \"2\"", false},
      {reps, "\"seed\": 1", false},
      {reps, "\"repetitions\": 2, \"seed\": 0", true},
      {reps, "\"repetitions\": 2, \"seed\": 9007199254740991", true},
      {reps, "\"repetitions\": 2, \"seed\": 9007199254740992", false},
      {reps, "\"repetitions\": 2, \"seed\": -1", false},
      {reps, "\"repetitions\": 2, \"colour\": 1", false},
      {reps, "\"repetitions\": 2, \"source\": \"a paper\", \"description\": \"\"", true},
      {reps, "\"repetitions\": 2, \"source\": 5", false},
      {reps, "\"repetitions\": 2, \"order\": {\"kind\": \"blocked\"}", true},
      {reps, "\"repetitions\": 2, \"order\": {\"kind\": \"randomised\"}", true},
      {reps, "\"repetitions\": 2, \"order\": {\"kind\": \"randomised\", \"seed\": 4}", true},
      {reps, "\"repetitions\": 2, \"order\": {\"kind\": \"blocked\", \"seed\": 4}", false},
      {reps, "\"repetitions\": 2, \"order\": {\"kind\": \"random\"}", false},
      {reps, "\"repetitions\": 2, \"order\": {}", false},
      {reps, "\"repetitions\": 2, \"order\": \"blocked\"", false},
      {reps, "\"repetitions\": 2, \"repetition\": {}", true},
      {reps, R"("repetitions": 2, "repetition": {"path": "new_patch", "remount_every": 1})", true},
      {reps, R"("repetitions": 2, "repetition": {"path": "same", "remount_every": "never"})", true},
      {reps, R"("repetitions": 2, "repetition": {"path": "elsewhere"})", false},
      {reps, R"("repetitions": 2, "repetition": {"remount_every": 0})", false},
      {reps, R"("repetitions": 2, "repetition": {"remount_every": "often"})", false},
      {reps, R"("repetitions": 2, "repetition": {"piece": "one"})", true},
      {reps, R"("repetitions": 2, "repetition": {"piece": "each_label_split"})", true},
      {reps, R"("repetitions": 2, "repetition": {"piece": "each_label_split", "pieces": 2})", true},
      {reps, R"("repetitions": 2, "repetition": {"piece": "each_label_split", "pieces": 1})",
       false},
      {reps, R"("repetitions": 2, "repetition": {"piece": "one", "pieces": 2})", false},
      {reps, R"("repetitions": 2, "repetition": {"pieces": 2})", false},
      {reps, R"("repetitions": 2, "repetition": {"colour": 1})", false},
      {reps, R"("repetitions": 2, "repetition": "same")", false},
      {reps, "\"repetitions\": 2, \"on_trial_failure\": \"continue\"", true},
      {reps, "\"repetitions\": 2, \"on_trial_failure\": \"retry\"", false},
      {reps, "\"repetitions\": 2, \"mount_timeout_s\": 5", true},
      {reps, "\"repetitions\": 2, \"mount_timeout_s\": 0", false},
      {reps, "\"repetitions\": 2, \"repeat_bad\": {\"at_most\": 2}", true},
      {reps, "\"repetitions\": 2, \"repeat_bad\": {\"at_most\": 0}", false},
      {reps, "\"repetitions\": 2, \"repeat_bad\": {\"lost_fraction\": 0.1}", false},
      {reps, "\"repetitions\": 2, \"repeat_bad\": {\"at_most\": 1, \"lost_fraction\": 2}", false},
      {reps,
       R"("repetitions": 2, "operator_steps": [{"before": "fabric", "text": "Mount {fabric}, the {number}.", "people_s": 90}])",
       true},
      {reps,
       R"("repetitions": 2, "operator_steps": [{"before": "fabric", "fabrics": ["silk"], "text": "x", "people_s": 0}])",
       true},
      {reps,
       R"("repetitions": 2, "operator_steps": [{"before": "campaign", "fabrics": ["silk"], "text": "x", "people_s": 0}])",
       false},
      {reps, R"("repetitions": 2, "operator_steps": [])", false},
      {reps, R"("repetitions": 2, "operator_steps": [{"before": "fabric", "text": "x"}])", false},
      {reps,
       R"("repetitions": 2, "operator_steps": [{"before": "fabric", "text": "{cloth}", "people_s": 1}])",
       false},
      {reps,
       R"("repetitions": 2, "operator_steps": [{"before": "fabric", "text": "a\nb", "people_s": 1}])",
       false},
      {reps,
       R"("repetitions": 2, "operator_steps": [{"before": "fabric", "text": "x", "people_s": 86401}])",
       false},
      {reps,
       R"("repetitions": 2, "finally": {"on_stop": [{"do": "park", "x_mm": 5, "y_m": 0.005}, {"do": "wait", "duration_s": 3}]})",
       true},
      {reps, R"("repetitions": 2, "finally": {"budget_s": 60})", true},
      {reps, R"("repetitions": 2, "finally": {"budget_s": 0.5})", false},
      {reps, R"("repetitions": 2, "finally": {"on_success": []})", false},
      {reps, R"("repetitions": 2, "finally": {"on_end": [{"do": "wait", "duration_s": 3}]})",
       false},
      {reps, R"("repetitions": 2, "finally": {"on_stop": [{"do": "park", "x_mm": 5}]})", false},
      {reps,
       R"("repetitions": 2, "finally": {"on_stop": [{"do": "park", "x_mm": 5, "x_m": 0, "y_mm": 5}]})",
       false},
      {reps, R"("repetitions": 2, "finally": {"on_stop": [{"do": "wait", "duration_s": 0}]})",
       false},
      {reps, R"("repetitions": 2, "finally": {"on_stop": [{"do": "dance"}]})", false},
      {reps, "\"repetitions\": 6, \"hand_over\": {}", true},
      {reps, "\"repetitions\": 6, \"hand_over\": false", true},
      {reps, "\"repetitions\": 6, \"hand_over\": true", false},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"learner\": \"lda\", \"groups\": 3}", true},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"learner\": \"forest\"}", false},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"from\": \"taxels\"}", true},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"from\": \"smell\"}", false},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"learner\": \"every\"}", false},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"from\": \"vibration\", \"learner\": \"lda\"}",
       false},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"groups\": 1}", false},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"at_most_s\": 0.5}", false},
      {reps, "\"repetitions\": 6, \"hand_over\": {\"folds\": 5}", false},
      {reps, "\"repetitions\": 2, \"settle\": {\"dwell_s\": 0.2, \"timeout_s\": 9}", true},
      {reps, "\"repetitions\": 2, \"settle\": {\"dwell\": 0.2}", false},
      {reps, "\"repetitions\": 2, \"settle\": {\"timeout_s\": 601}", false},
      {reps, "\"repetitions\": 2, \"approach\": {\"speed_mm_s\": 1}", true},
      {reps, "\"repetitions\": 2, \"approach\": {\"speed_mm_s\": 1, \"speed_mps\": 0.001}", false},
      {reps, "\"repetitions\": 2, \"approach\": {\"seat_speed_mps\": 0.001}", true},
      {reps, "\"repetitions\": 2, \"approach\": {\"contact_force_N\": 0.2}", true},
      {reps, "\"repetitions\": 2, \"approach\": {\"contact_force_N\": 0.001}", false},
      {reps, R"("sweep": {"replicates": 3, "factors": [{"name": "force_N", "values": [3, 5]}]})",
       true},
      {reps,
       R"("sweep": {"replicates": 3, "block_by": "none", "order": "randomised", "seed": 4, "design": {"cell_fraction": 1, "model": "linear"}, "factors": [{"name": "speed_mm_s", "values": [1, 2]}, {"name": "stroke_m", "values": [0.01]}]})",
       true},
      {reps,
       R"("sweep": {"replicates": 3, "factors": [{"name": "direction_deg", "values": [0, -45]}]})",
       true},
      {reps,
       R"("sweep": {"replicates": 3, "factors": [{"name": "direction_deg", "values": [0, 361]}]})",
       false},
      {reps, R"("sweep": {"replicates": 3, "factors": []})", false},
      {reps, R"("sweep": {"factors": [{"name": "force_N", "values": [3, 5]}]})", false},
      {reps, R"("sweep": {"replicates": 3, "factors": [{"name": "force_N", "values": []}]})",
       false},
      {reps, R"("sweep": {"replicates": 3, "factors": [{"name": "force", "values": [3]}]})", false},
      {reps, R"("sweep": {"replicates": 3, "factors": [{"name": "press_s", "values": [3, 3]}]})",
       false},
      {reps,
       R"("sweep": {"replicates": 3, "order": "as_listed", "seed": 4, "factors": [{"name": "force_N", "values": [3]}]})",
       false},
      {reps,
       R"("sweep": {"replicates": 3, "design": "half", "factors": [{"name": "force_N", "values": [3]}]})",
       false},
      {reps,
       R"("repetitions": 2, "sweep": {"replicates": 3, "factors": [{"name": "force_N", "values": [3]}]})",
       false},
      {"\"schema_version\": 1", "\"schema_version\": 2", false},
      {"\"schema_version\": 1,", "", false},
      {"\"name\": \"small\"", "\"name\": \"\"", false},
      {"\"name\": \"small\"", "\"name\": \"a/b\"", false},
      {"\"name\": \"small\"", "\"name\": \".hidden\"", false},
      {"\"name\": \"small\"", "\"name\": \"-rf\"", false},
      {"\"name\": \"small\"", "\"name\": \"_a-b.C9\"", true},
      {reps,
       R"("repetitions": {"parameter": "n"}, "parameters": {"n": {"type": "integer", "default": 2}})",
       true},
      {reps,
       R"("repetitions": {"parameter": "n"}, "parameters": {"n": {"type": "real", "default": 2}})",
       false},
      {reps,
       R"("repetitions": {"parameter": "n"}, "parameters": {"n": {"type": "integer", "unit": "kg", "default": 2}})",
       false},
      {reps,
       R"("repetitions": {"parameter": "n"}, "parameters": {"n": {"type": "integer", "default": []}})",
       false},
      {reps,
       R"("repetitions": {"parameter": "n"}, "parameters": {"-n": {"type": "integer", "default": 2}})",
       false},
      {reps, R"("repetitions": {"parameter": "n", "else": 2})", false},
      {reps,
       R"("repetitions": 2, "on_trial_failure": {"parameter": "then"}, "parameters": {"then": {"type": ["stop", "continue"], "default": "stop"}})",
       true},
      {reps, R"("repetitions": 2, "bound_parameters": {"force_N": 3, "first": true})", true},
      {reps, R"("repetitions": 2, "bound_parameters": {"force_N": [3]})", false},
      {"[\"denim\", \"silk\"]", "[]", false},
      {"[\"denim\", \"silk\"]", "[\"denim\", \"denim\"]", false},
      {"[\"denim\", \"silk\"]", "[\"denim\", 3]", false},
      {"[\"denim\", \"silk\"]", "\"denim\"", false},
      {"\"M2\"", "\"M 2\"", false},
      {"\"duration_s\": 3", "\"duration_s\": 0", false},
      {"\"duration_s\": 3", "\"duration_s\": 3601", false},
      {"\"duration_s\": 3", "\"duration_ms\": 3", false},
      {"\"duration_s\": 3", "\"duration_s\": 3, \"force_N\": 5", false},
      {"\"force_N\": 5", "\"force_n\": 5", true},
      {"\"force_N\": 5", "\"force_N\": 0", true},
      {"\"force_N\": 5", "\"force_N\": -1", false},
      {"\"force_N\": 5", "\"force_N\": 5, \"force_n\": 5", false},
      {"\"force_N\": 5", "\"force_N\": 5, \"force_band_n\": 0.5", true},
      {"\"force_N\": 5", "\"force_N\": 5, \"force_band_N\": 0.5, \"force_band_n\": 0.5", false},
      {"\"force_N\": 5", "\"force_N\": 5, \"force_band_N\": 0", false},
      {"\"force_N\": 5,", "", false},
      {"\"force_N\": 5", "\"force\": 5", false},
      {"\"speed_mm_s\": 2", "\"speed_mps\": 0.002", true},
      {"\"speed_mm_s\": 2", "\"speed_mm_s\": 2, \"speed_mps\": 0.002", false},
      {"\"speed_mm_s\": 2", "\"speed_cm_s\": 0.2", false},
      {"\"speed_mm_s\": 2", "\"speed_mm_s\": 0", false},
      {"\"speed_mm_s\": 2", "\"speed_mm_s\": 2, \"force_N\": 5", true},
      {"\"speed_mm_s\": 2", "\"speed_mm_s\": 2, \"duration_s\": 5", false},
      {"\"dy_mm\": 50", "\"dy_m\": 0.05", true},
      {"\"dy_mm\": 50", "\"dy_mm\": 50, \"dy_m\": 0.05", false},
      {"\"dx_mm\": 0, ", "", false},
      {"{\"phase\": \"S\", \"duration_s\": 3},", "", false},
      {"\"phase\": \"S\"", "\"phase\": \"X\"", false},
      {"{\"phases\"", "{\"start\": {\"x_mm\": 40, \"y_m\": 0.04}, \"phases\"", true},
      {"{\"phases\"", "{\"start\": {\"x_mm\": 40}, \"phases\"", false},
      {"{\"phases\"", "{\"begin\": {}, \"phases\"", false},
      {"{\"phases\"", "{\"live_vote\": {\"model\": \"m\"}, \"phases\"", true},
      {"{\"phases\"", "{\"live_vote\": {}, \"phases\"", false},
      {"{\"phases\"", "{\"live_vote\": {\"model\": \"\"}, \"phases\"", false},
      {"{\"phases\"", "{\"live_vote\": {\"model\": 3}, \"phases\"", false},
      {"{\"phases\"",
       "{\"live_vote\": {\"model\": \"m\", \"stop_early\": {\"sure_probability\": 0.9, "
       "\"least_slide_s\": 1}}, \"phases\"",
       true},
      {"{\"phases\"",
       "{\"live_vote\": {\"model\": \"m\", \"stop_early\": {\"sure_probability\": 0.9}}, "
       "\"phases\"",
       false},
      {"{\"phases\"",
       "{\"live_vote\": {\"model\": \"m\", \"stop_early\": {\"sure_probability\": 1, "
       "\"least_slide_s\": 1}}, \"phases\"",
       false},
      {"{\"phases\"",
       "{\"live_vote\": {\"model\": \"m\", \"stop_early\": {\"sure_probability\": 0.9, "
       "\"least_slide_s\": 1, \"x\": 1}}, \"phases\"",
       false},
  };
  for (const Case& c : cases) {
    const std::string recipe = small_with(c.from, c.to);
    INFO(c.from << " -> " << c.to);
    CHECK(schema_accepts(recipe) == c.good);
    CHECK(parser_accepts(recipe) == c.good);
  }
}

TEST_CASE("Every property of the schema is explained to the person who hovers over it") {
  const json schema = json::parse(source_file("recipes/schema/recipe.schema.json"));
  for (const auto& [name, definition] : schema["$defs"].items()) {
    if (!definition.contains("properties")) continue;
    for (const auto& [key, property] : definition["properties"].items()) {
      INFO(name << "." << key);
      CHECK((property.contains("description") || property.contains("const") ||
             property.contains("$ref") || key == "description"));
    }
  }
}

TEST_CASE("The schema is of draft 2020-12, and every quantity in it names its unit") {
  const json schema = json::parse(source_file("recipes/schema/recipe.schema.json"));
  CHECK(schema["$schema"] == "https://json-schema.org/draft/2020-12/schema");
  const std::string text = schema.dump();
  for (const char* old : {"\"definitions\"", "#/definitions/", "additionalItems"}) {
    INFO(old);
    CHECK(text.find(old) == std::string::npos);
  }
  const std::map<std::string, std::string> units{
      {"_mm_s", "mm/s"}, {"_mps", "m/s"}, {"_N", "N"},        {"_n", "N"},          {"_mm", "mm"},
      {"_m", "m"},       {"_s", "s"},     {"_fraction", "1"}, {"_probability", "1"}};
  const auto unit_of = [&](const std::string& key) {
    std::string found, suffix;
    for (const auto& [end, unit] : units)
      if (key.ends_with(end) && end.size() > suffix.size())
        std::tie(suffix, found) = std::tie(end, unit);
    return found;
  };
  std::size_t quantities = 0;
  const std::function<void(const json&)> inspect = [&](const json& part) {
    if (part.is_object() && part.contains("properties"))
      for (const auto& [key, property] : part["properties"].items())
        if (property.contains("anyOf") && property["anyOf"][0].value("type", json()) == "number") {
          INFO(key);
          ++quantities;
          CHECK(property["anyOf"][1] == json{{"$ref", "#/$defs/reference"}});
          CHECK_FALSE(unit_of(key).empty());
          CHECK(property.value("x-unit", "") == unit_of(key));
        }
    if (part.is_structured())
      for (const json& inner : part) inspect(inner);
  };
  inspect(schema);
  CHECK(quantities > 30);
}

}  // namespace schema_test
