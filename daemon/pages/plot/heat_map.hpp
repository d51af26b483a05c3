#pragma once
// A confusion matrix as a picture.

#include <string>
#include <string_view>

#include "classifier/evaluate/confusion.hpp"

namespace weft::daemon {

/// Rows are the true fabrics, columns what they were taken for; counts in the cells. Shade is the
/// root of the share of the row: blue on the diagonal, orange off it, a pair that colour-blind
/// readers tell apart; the count says the same without colour.
std::string confusion_map(const classifier::Confusion& confusion, std::string_view title);

/// The `count` most frequent mistakes, in words: "silk taken for satin 14 times (3.9 %)".
std::string worst_confusions(const classifier::Confusion& confusion, std::size_t count);

}  // namespace weft::daemon
