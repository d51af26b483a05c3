#pragma once
// A confusion matrix as a chart.

#include <string>
#include <string_view>

#include "classifier/evaluate/splits.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {

/// Rows are the true labels, columns the predicted ones; counts and, where there is room, shares of
/// the row; right of each row the share of it that is right. Shade is the root of the share: blue
/// on the diagonal, orange off it. `order`: labels by their place in the matrix.
chart::Cells confusion_cells(const classifier::Confusion& confusion, std::string_view title,
                             const std::vector<std::size_t>& order);
/// Most errors of a row first; equal ones in the matrix's order.
std::vector<std::size_t> order_by_errors(const classifier::Confusion& confusion);
/// In the order of the matrix; folded below it most errors first, where that is another order.
Blocks confusion_pictures(const classifier::Confusion& confusion, std::string_view title);

/// The `count` most frequent errors: "silk predicted as satin 14 times (3.9 %)".
std::string worst_confusions(const classifier::Confusion& confusion, std::size_t count);

}  // namespace weft::daemon
