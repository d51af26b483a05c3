#pragma once
// Pieces of a page. Arguments named `html` are markup already; all others are escaped.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {

// Marks that tell families of points apart by shape as well as by colour.

/// Families beyond this many share marks with the first ones.
inline constexpr std::size_t mark_kinds = 7;

/// CSS class with the family's colour.
std::string mark_class(std::size_t family);

void draw_mark(svg::Canvas& canvas, svg::Point at, std::size_t family);

/// Colours of the classes and of the class "whisker", for light and dark pages, beside
/// style_sheet().
std::string_view marks_style();

// What the pages of all trades are made of.

/// "SIMULATED" and so on, in a box.
std::string bench_badge(BenchKind kind);

inline std::string simulated_badge() {
  return bench_badge(BenchKind::simulated);
}
/// A line of a definition list; a dash where there is no value.
std::string definition(std::string_view name, std::string_view value);
/// A whole page around `main_html`, with the styles of tables, marks and scatter pictures.
std::string page_around(std::string_view title, std::string_view main_html);

/// The page's style sheet.
std::string_view style_sheet();

/// A table whose first column names the row.
class HtmlTable {
 public:
  /// `head_html`: one cell per column. `figures_from`: the column from which on cells hold numbers.
  HtmlTable(std::vector<std::string> head_html, std::size_t figures_from = 1);
  void row(const std::vector<std::string>& cells_html, std::string_view css_class = {});
  [[nodiscard]] std::string finish() const;

 private:
  std::size_t figures_from_;
  std::string out_;
};

/// A picture as a file of its own: with the page's style and ground.
std::string standalone_svg(std::string_view svg);

/// <figure> with the bench's badge in its caption: no picture or table can be cut out without it.
std::string figure(std::string_view body_html, std::string_view caption_html,
                   std::string_view badge_html, std::string_view css_class = {});

/// "range.M.4" as F with indices, as the paper writes it.
std::string feature_html(std::string_view name);

}  // namespace weft::daemon
