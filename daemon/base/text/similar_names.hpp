#pragma once
// Finds names that look alike but are not equal.

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {

/// Warnings about pairs of `names` (UTF-8). similar_names: two names differ only in blanks,
/// invisible characters, kinds of dashes, look-alike letters of other scripts, or composed and
/// separate marks. capital_letters: they differ in Latin capital letters as well. `what`: the kind
/// of the names, such as "labels".
std::vector<Warning> find_similar_names(const std::set<std::string>& names, std::string_view what);

/// Whether a name (UTF-8) looks empty: only blanks, which quotes keep, and invisible characters.
bool is_invisible(std::string_view name);

}  // namespace weft::daemon
