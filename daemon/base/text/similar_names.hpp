#pragma once
// Names that look alike and are not equal.

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {

/// A warning similar_names for each two of `names` (UTF-8) that differ only in blanks, in
/// characters that cannot be seen, in the kind of a dash, in letters of other scripts that are
/// drawn alike, or in how a letter with marks is written (composed or not); capital_letters where
/// they differ in Latin capital letters besides. `what` they are: "labels".
std::vector<Warning> find_similar_names(const std::set<std::string>& names, std::string_view what);

/// Whether a name (UTF-8) cannot be told from none: blanks, as quotes keep them, and what cannot be
/// seen.
bool is_invisible(std::string_view name);

}  // namespace weft::daemon
