#pragma once
// Marks that differ by shape as well as by colour for families of points; legends and axes.

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/pages/plot/chart.hpp"
#include "daemon/pages/plot/text_layout.hpp"

namespace weft::daemon::chart {

inline constexpr double front_radius = 9;

/// CSS class with the family's colour.
std::string mark_class(std::size_t family);
void draw_mark(svg::Canvas& canvas, svg::Point at, std::size_t family);

/// An entry of a legend: its text, and a function that draws its mark from a left end point. A mark
/// is at most 16 user units wide.
struct Key {
  std::string words;
  std::function<void(svg::Canvas&, svg::Point)> mark;
};
/// Height [user units] of a legend in a picture of that width.
double legend_height(const std::vector<Key>& keys, double width);
/// Starts at the top left corner {left, 0}.
void draw_legend(svg::Sheet& sheet, const std::vector<Key>& keys, double left, double width);

struct TickLabel {
  double at = 0;
  std::string text;
};
/// Returns about `count` labels.
std::vector<TickLabel> tick_labels(const Axis& axis, const svg::Range& range, int count);
/// The range of an axis for these values.
svg::Range range_of(const Axis& axis, const std::vector<double>& values);

/// Draws lines, numbers and title below the area.
void draw_x_axis(svg::Sheet& sheet, const svg::Box& area, const svg::Scale& scale, const Axis& axis,
                 bool numbers = true);
/// Height [user units] that draw_x_axis() needs below the area.
double x_axis_height(const Axis& axis, double width, bool numbers = true);

}  // namespace weft::daemon::chart
