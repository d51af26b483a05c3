#pragma once
// A stored booster, looked over before XGBoost reads it: the library follows the nodes, groups and
// lengths that it finds in a file, wherever they lead.

#include <cstddef>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

/// Trees of each class in the one round of XGBRF; XGB has one in each of its rounds.
inline constexpr std::size_t trees_of_forest = 100;

/// The text as XGBoost is to read it: each name once, the same numbers. Refuses (Errc::corrupt)
/// what is no gbtree of multi:softprob for so many features and classes in XGBoost's JSON, and
/// trees that lead nowhere: a child that is no node or has two parents, a feature or a class beyond
/// the last, lists of unlike lengths, splits by category.
Result<std::string> checked_booster(std::string_view text, std::size_t features,
                                    std::size_t classes);

}  // namespace weft::classifier::vibro
