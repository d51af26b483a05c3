#pragma once
// The recipe's JSON Schema, built into the program from recipes/schema/recipe.schema.json.

#include <string_view>

namespace weft::daemon::api {

std::string_view recipe_schema_json();

}  // namespace weft::daemon::api
