#pragma once
// Suggestions for misspelt names ("Did you mean ...?").

#include <string>
#include <string_view>
#include <vector>

namespace weft {

/// The candidate that is probably meant by `word`: letter case ignored, at most a third of the
/// letters wrong, missing, extra or swapped. Empty if no candidate is near enough.
std::string_view closest(std::string_view word, const std::vector<std::string_view>& candidates);

/// A hint: "Did you mean reset?" with the candidate that is probably meant, else `otherwise`.
std::string did_you_mean(std::string_view word, const std::vector<std::string_view>& candidates,
                         std::string otherwise = {});

}  // namespace weft
