#pragma once
// Marks that tell families of points apart by shape as well as by colour.

#include <cstddef>
#include <string>
#include <string_view>

#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {

/// Families beyond this many share marks with the first ones.
inline constexpr std::size_t mark_kinds = 7;

/// CSS class with the family's colour.
std::string mark_class(std::size_t family);

void draw_mark(svg::Canvas& canvas, svg::Point at, std::size_t family);

/// Colours of the classes and of the class "whisker", for light and dark pages, beside
/// style_sheet().
std::string_view marks_style();

}  // namespace weft::daemon
