#pragma once
// A heat map of two factors.

#include <optional>
#include <string>
#include <vector>

namespace weft::daemon {

struct GridCell {
  double value = 0;     ///< decides the shade
  std::string words;    ///< written in the cell
  std::string second;   ///< and beneath it, smaller: the interval
  bool marked = false;  ///< a diamond: the recommended one
};

struct GridMap {
  std::string title;  ///< read out in the picture's place
  std::string stamp;  ///< written into the picture: "SIMULATED"
  std::string x_title, y_title;
  std::vector<std::string> x, y;  ///< labels of columns and rows
  /// [rows][columns]; nothing where the design has no such cell.
  std::vector<std::vector<std::optional<GridCell>>> cells;
};

/// <svg>: the darker the larger, from the least to the greatest value of the map; rows from below.
std::string grid_map(const GridMap& map);

}  // namespace weft::daemon
