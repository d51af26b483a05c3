#pragma once
// Draws a confusion matrix as a chart.

#include <string>
#include <string_view>

#include "classifier/evaluate/splits.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {

/// Rows are the true labels, columns the predicted ones. Cells show counts and, if there is room,
/// shares of the row; the row's accuracy is right of it. Shade is the root of the share: blue on
/// the diagonal, orange off it. `order`: labels by their place in the matrix.
chart::Cells confusion_cells(const classifier::Confusion& confusion, std::string_view title,
                             const std::vector<std::size_t>& order);
/// Labels by errors in their row, most first; equal ones in the matrix's order.
std::vector<std::size_t> order_by_errors(const classifier::Confusion& confusion);
/// The matrix in its own order. Below it, folded, with most errors first if that order differs.
Blocks confusion_pictures(const classifier::Confusion& confusion, std::string_view title);

/// The `count` most frequent errors: "silk predicted as satin 14 times (3.9 %)".
std::string worst_confusions(const classifier::Confusion& confusion, std::size_t count);

}  // namespace weft::daemon
