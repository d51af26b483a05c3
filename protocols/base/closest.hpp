#pragma once
// Did you mean ...?

#include <string_view>
#include <vector>

namespace weft {

/// The candidate that `word` probably meant: letter case ignored, at most a third of the letters
/// wrong, missing, extra or swapped. Empty when none comes near.
std::string_view closest(std::string_view word, const std::vector<std::string_view>& candidates);

}  // namespace weft
