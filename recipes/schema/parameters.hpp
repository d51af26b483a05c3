#pragma once
// Parameters of a recipe. They are declared by name and type in "parameters" and used as
// {"parameter": NAME} in the place of a value. They are bound before anything else reads the
// recipe. The resolved recipe, with values in place of references, is recorded and run; it needs no
// binding. Thread: any.

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// The rule of is_parameter_name(), for "expected".
inline constexpr std::string_view parameter_name_rule =
    "1 to 64 letters, digits and '_', the first a letter";
bool is_parameter_name(std::string_view text);

/// Replaces each reference in `document` with its value from `values_json` ({NAME: value}, or
/// empty), or with the default. The block "parameters" becomes "bound_parameters", {NAME: value}.
/// Returns whether there was such a block; a document without it does not change.
/// Problems at /parameters/NAME: an invalid declaration, a parameter without reference, and a value
/// that is undeclared, missing, of another type or out of range.
/// Problems at a reference: an undeclared parameter, or a unit other than that of the key.
bool bind_parameters(nlohmann::json& document, std::string_view values_json, Problems& problems);

/// Checks "bound_parameters" of a resolved recipe, which serve the record only.
void read_bound_parameters(ObjectReader& recipe, Problems& problems);

}  // namespace weft::recipes
