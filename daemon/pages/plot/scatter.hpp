#pragma once
// A picture of shares, or of errors on a logarithmic axis of their own, against times on a
// logarithmic axis: one panel per kind of time or error.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/evaluate/splits.hpp"

namespace weft::daemon {

// A confusion matrix as a picture.

/// Rows are the true fabrics, columns what they were taken for; counts in the cells. Shade is the
/// root of the share of the row: blue on the diagonal, orange off it, a pair that colour-blind
/// readers tell apart; the count says the same without colour.
std::string confusion_map(const classifier::Confusion& confusion, std::string_view title);

/// The `count` most frequent mistakes, in words: "silk taken for satin 14 times (3.9 %)".
std::string worst_confusions(const classifier::Confusion& confusion, std::size_t count);

/// A mark with its interval. `family` chooses shape and colour.
struct ScatterPoint {
  double time_s = 0;  ///< positive
  double share = 0;   ///< 0 to 1, with the interval low to high; or a positive error
  double low = 0;
  double high = 1;
  std::size_t family = 0;
  bool front = false;
  std::string label;  ///< written beside points on the front
};

/// A level across a panel, such as a sensor's resolution.
struct ScatterLine {
  double share = 0;
  std::string label;
  bool below = false;  ///< the label stands under the line
};

struct ScatterPanel {
  std::string title;  ///< "(a) ..."
  std::string x_title;
  std::vector<ScatterPoint> points;
  std::vector<ScatterLine> lines{};
  bool counts = false;  ///< `time_s` of the points is a number of things, not seconds
};

struct Scatter {
  std::string words;  ///< what the picture shows, read out in its place
  std::string y_title;
  std::string stamp;                  ///< written into the picture: "SIMULATED"
  std::vector<std::string> families;  ///< legend, in the order of ScatterPoint::family
  std::vector<ScatterPanel> panels;
  /// Errors, on a logarithmic axis and without intervals: less is better. Else shares.
  bool errors = false;
};

/// <svg>: panels side by side on one share axis, a mark per family, 95 % intervals as bars, points
/// on the front in a diamond and joined by a staircase (what the best choice up to a time reaches),
/// a legend. Points whose time is not positive and finite are left out, and errors that are not.
std::string scatter_figure(const Scatter& scatter);

/// What the picture needs beside style_sheet() and marks_style().
std::string_view scatter_style();

}  // namespace weft::daemon
