#pragma once
// What differs between two recipes, by JSON pointer.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>

namespace weft::daemon::api {

/// [{where, change: "added" | "removed" | "changed", was, is}], objects by key, lists by position;
/// `was` and `is` where there is such a thing. At most `most`; `all` counts them all.
/// Goes one call deeper at each level of the two: their depth is bounded by whoever read them.
nlohmann::json differences(const nlohmann::json& was, const nlohmann::json& is, std::size_t most,
                           std::size_t& all);

}  // namespace weft::daemon::api
