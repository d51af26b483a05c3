#pragma once
// Charts as data, and their one renderer. A chart contains everything that its picture shows, so
// the picture can be drawn again from JSON (daemon/pages/document/document.hpp). Pure; any thread.

#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace weft::daemon::chart {

inline constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

/// A point of a series; NaN in x or y is a gap.
struct Sample {
  double x = 0;
  double y = 0;
  double low = no_number;  ///< an interval of y; NaN: none
  double high = no_number;
  std::string label{};  ///< written beside the point if there is room
  bool front = false;   ///< drawn as a diamond, and on the panel's staircase
};

enum class Line { none, solid, thin, dashed };

/// Points with one name. `family` chooses colour and shape, the same in all panels.
struct Series {
  std::string name{};  ///< in the legend; empty: not in it
  std::size_t family = 0;
  Line line = Line::none;
  bool marks = true;
  std::vector<Sample> points{};
};

/// An axis. If `low` or `high` is NaN, its range is that of the data.
struct Axis {
  std::string title{};
  bool logarithmic = false;
  double low = no_number;
  double high = no_number;
  bool seconds = false;              ///< ticks as "150 µs", "2 ms"
  std::vector<std::string> names{};  ///< names of the whole numbers from 0, instead of a scale
};

/// A part of x that is shaded over the whole height, such as phase M. `name` is its letter.
struct Span {
  double from = 0;
  double to = 0;
  std::string name{};
};

/// A shaded rectangle in data units: a tolerance, or a bar with its number.
struct Area {
  double x_from = 0;
  double x_to = 0;
  double y_from = 0;
  double y_to = 0;
  std::string label{};
  bool bar = false;  ///< a bar, not a tolerance
};

/// A horizontal line across the panel.
struct Limit {
  double value = 0;
  std::string label{};
  bool diagonal = false;  ///< from one corner to the other, `value` unused
};

struct Panel {
  std::string title{};
  Axis x{};
  Axis y{};
  std::vector<Span> spans{};
  std::vector<Area> areas{};
  std::vector<Series> series{};
  std::vector<Limit> limits{};
};

/// Panels with axes, side by side, with a legend above them.
struct Plot {
  std::string words{};  ///< description for screen readers, instead of the picture
  std::string stamp{};  ///< "SIMULATED"; drawn in the picture
  std::size_t columns = 1;
  double width = 760;
  double panel_height = 240;  ///< of the area with the curves
  bool shared_x = false;      ///< one range; numbers only below the lowest panels
  bool shared_y = false;      ///< one range; numbers only left of the first panels
  std::string area_name{};    ///< of the shaded areas, in the legend
  std::string front_name{};   ///< of the diamonds, in the legend
  std::vector<Panel> panels{};
};

/// A name with a value, an interval and reference marks; NaN: no such mark.
struct Row {
  std::string name{};
  double value = 0;
  double low = no_number;
  double high = no_number;
  std::vector<double> marks{};
};

/// One line per name, such as accuracies or forces by fabric.
struct Rows {
  std::string words{};
  Axis x{};
  std::string value_name{};
  std::vector<std::string>
      mark_names{};  ///< the first is a diamond, the second a ring; empty: none
  std::string limit_name{};
  double limit = no_number;
  bool bars = false;  ///< values as bars from the left end
  double width = 560;
  std::vector<Row> rows{};
};

enum class CellKind { empty, hit, miss };

struct Cell {
  std::size_t row = 0;
  std::size_t column = 0;
  std::string text{};
  std::string second{};  ///< second line
  double shade = 0;      ///< 0 to 1
  CellKind kind = CellKind::empty;
  bool marked = false;  ///< has a diamond
};

/// A matrix with text and shade; all cells have one size, whatever the page's width. Cells that are
/// not listed are empty.
struct Cells {
  std::string words{};
  std::string title{};  ///< above the picture
  std::string x_title{};
  std::string y_title{};
  std::vector<std::string> columns{};
  std::vector<std::string> rows{};  ///< from the top
  std::string notes_title{};
  std::vector<std::string> row_notes{};  ///< right of each row
  std::vector<Cell> cells{};
};

/// A small picture of rows x columns values. `levels` has one hexadecimal digit per value, row by
/// row.
struct Tile {
  std::string title{};
  std::string note{};
  std::size_t columns = 0;
  std::string levels{};
};

struct Maps {
  std::string words{};
  std::vector<Tile> tiles{};
};

/// One divided bar: name and part of each share.
struct Shares {
  std::string words{};
  std::vector<std::pair<std::string, double>> parts{};
};

using Chart = std::variant<Plot, Rows, Cells, Maps, Shares>;

/// Draws <svg>: no text overlaps another or leaves the picture, whatever the names are. Text that
/// does not fit is shortened, with the full text as a tool tip, or left out.
std::string draw(const Chart& chart);
std::string draw(const Plot& plot);
std::string draw(const Rows& rows);
std::string draw(const Cells& cells);
std::string draw(const Maps& maps);
std::string draw(const Shares& shares);

/// A point of one of several families.
struct FamilySample {
  std::size_t family = 0;
  Sample sample;
};
/// A series of marks for each name with points, in the order of the names.
std::vector<Series> series_of(const std::vector<std::string>& families,
                              const std::vector<FamilySample>& points);
/// An axis for shares with intervals: low and high in per cent, at multiples of 5, with room above.
Axis percent_axis(std::string title, const std::vector<FamilySample>& points);

inline constexpr std::size_t family_count = 7;  ///< further ones share marks with the first

}  // namespace weft::daemon::chart
