#pragma once
// Parameters of a recipe: declared by name and type in "parameters", used as {"parameter": NAME}
// where a value stands, bound to values before anything else reads the recipe. What is recorded and
// run is the resolved recipe: it has values in their place and needs no binding. Thread: any.

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// What a parameter's name is made of, for "expected".
inline constexpr std::string_view parameter_name_rule =
    "1 to 64 letters, digits and '_', the first a letter";
bool is_parameter_name(std::string_view text);

/// Replaces each reference in `document` by its value: of `values_json` ({NAME: value}, or empty),
/// else the default. The block "parameters" becomes "bound_parameters", {NAME: value}. Returns
/// whether there was one; a document without it stays as it is. Problems, at /parameters/NAME: a
/// declaration that cannot be used, a parameter that nothing refers to, a value without
/// declaration, of another type, out of range or missing; at its place, a reference to what is not
/// declared or has another unit than its key.
bool bind_parameters(nlohmann::json& document, std::string_view values_json, Problems& problems);

/// Checks "bound_parameters" of a resolved recipe, which are kept for the record alone.
void read_bound_parameters(ObjectReader& recipe, Problems& problems);

}  // namespace weft::recipes
