#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/marks.hpp"

namespace weft::daemon::chart {
namespace {

using svg::Anchor;
using svg::Box;
using svg::Canvas;
using svg::Point;
using svg::Sheet;
namespace text = svg::text;

constexpr double cell_edge = 6, cell_gap = 8, longest_row_name = 190, longest_column_name = 130;
constexpr double line_height = 14, least_cell = 18, light_on_dark = 0.62;

/// Sizes of a matrix on its sheet.
struct Grid {
  double cell_width = least_cell, cell_height = least_cell;
  double left = 0, top = 0, width = 0, height = 0, notes = 0;
  bool turned = false;  ///< column names
  std::vector<std::string> rows, columns;
};

void size_cells(const Cells& chart, Grid& grid) {
  for (const Cell& cell : chart.cells) {
    for (const std::string* one : {&cell.text, &cell.second})
      grid.cell_width = std::max(grid.cell_width, svg::text_width(*one, text::cell) + 6);
    if (!cell.second.empty()) grid.cell_height = 2 * line_height + 4;
  }
  if (chart.columns.size() <= 6) grid.cell_width = std::max(grid.cell_width, 44.0);
  if (chart.rows.size() == chart.columns.size())
    grid.cell_height = std::max(grid.cell_height, std::min(grid.cell_width, 44.0));
}

Grid grid_of(const Cells& chart) {
  Grid out;
  size_cells(chart, out);
  out.rows = svg::shorten_labels(chart.rows, longest_row_name, text::tick);
  out.turned = svg::widest(chart.columns, text::tick) + 6 > out.cell_width;
  out.columns = svg::shorten_labels(chart.columns,
                                    out.turned ? longest_column_name : out.cell_width, text::tick);
  out.width = out.cell_width * static_cast<double>(chart.columns.size());
  out.height = out.cell_height * static_cast<double>(chart.rows.size());
  out.left = svg::widest(out.rows, text::tick) + cell_gap + (chart.y_title.empty() ? 0 : 20);
  out.top = (chart.title.empty() ? 0 : 22) + (chart.x_title.empty() ? 0 : 18) + cell_gap +
            (out.turned ? svg::widest(out.columns, text::tick) : line_height);
  if (!chart.row_notes.empty())
    out.notes = cell_gap + std::max(svg::widest(chart.row_notes, text::tick),
                                    svg::text_width(chart.notes_title, text::tick));
  return out;
}

void draw_cell(Sheet& sheet, const Cell& cell, const Box& box) {
  constexpr std::array<std::string_view, 3> classes{"cell-empty", "cell-hit", "cell-miss"};
  sheet.canvas.rect(box, classes.at(static_cast<std::size_t>(cell.kind)),
                    cell.kind == CellKind::empty ? 1 : cell.shade);
  const bool on = cell.kind != CellKind::empty && cell.shade > light_on_dark;
  const svg::TextStyle& style = on ? text::cell_on : text::cell;
  const double middle = box.x + box.width / 2, centre = box.y + box.height / 2 + 4;
  const double shift = cell.second.empty() ? 0 : line_height / 2;
  sheet.write({middle, centre - shift}, cell.text, style, Anchor::middle);
  sheet.write({middle, centre + shift}, cell.second, style, Anchor::middle);
  if (cell.marked) sheet.canvas.diamond({box.x + 7, box.y + 7}, 5, "front-mark");
}

void name_grid(Sheet& sheet, const Cells& chart, const Grid& grid) {
  for (std::size_t r = 0; r < grid.rows.size(); ++r) {
    const double y = grid.top + (static_cast<double>(r) + 0.5) * grid.cell_height + 4;
    sheet.write({grid.left - cell_gap + 2, y}, grid.rows[r], text::tick, Anchor::end, false,
                chart.rows[r]);
    if (r < chart.row_notes.size())
      sheet.write({grid.left + grid.width + grid.notes, y}, chart.row_notes[r], text::tick,
                  Anchor::end);
  }
  sheet.write({grid.left + grid.width + grid.notes, grid.top - cell_gap + 2}, chart.notes_title,
              text::tick, Anchor::end);
  for (std::size_t c = 0; c < grid.columns.size(); ++c) {
    const double x = grid.left + (static_cast<double>(c) + 0.5) * grid.cell_width;
    if (grid.turned)
      sheet.write({x + 4, grid.top - cell_gap + 4}, grid.columns[c], text::tick, Anchor::start,
                  true, chart.columns[c]);
    else
      sheet.write({x, grid.top - cell_gap + 2}, grid.columns[c], text::tick, Anchor::middle, false,
                  chart.columns[c]);
  }
}

double level_of(char digit) {
  return digit >= 'a' ? digit - 'a' + 10 : digit - '0';
}

constexpr std::size_t level_count = 16;

/// Draws one path for each level: runs of equal values as bars. Level 0 is the ground.
void draw_tile(Canvas& canvas, const Tile& tile, const Box& box) {
  canvas.rect(box, "map-ground");
  if (tile.columns == 0 || tile.levels.empty()) return;
  const std::size_t rows = (tile.levels.size() + tile.columns - 1) / tile.columns;
  const double step_x = box.width / static_cast<double>(tile.columns),
               step_y = box.height / static_cast<double>(rows);
  std::array<std::string, level_count> paths;
  for (std::size_t i = 0, end = 0; i < tile.levels.size(); i = end) {
    end = i + 1;
    const std::size_t row = i / tile.columns;
    while (end < tile.levels.size() && tile.levels[end] == tile.levels[i] &&
           end / tile.columns == row)
      ++end;
    const double x = box.x + static_cast<double>(i % tile.columns) * step_x;
    const double y = box.y + static_cast<double>(row) * step_y;
    const auto level = static_cast<std::size_t>(level_of(tile.levels[i]));
    if (level > 0 && level < level_count)
      paths.at(level) += "M" + coordinate(x) + " " + coordinate(y) + "h" +
                         coordinate(static_cast<double>(end - i) * step_x) + "v" +
                         coordinate(step_y) + "H" + coordinate(x) + "z";
  }
  for (std::size_t level = 1; level < level_count; ++level)
    canvas.path(paths.at(level), "map-level",
                static_cast<double>(level) / static_cast<double>(level_count - 1));
}

void draw_row(Sheet& sheet, const Rows& chart, const Row& row, const svg::Scale& x, double y) {
  Canvas& canvas = sheet.canvas;
  const auto inside = [&](double value) { return std::clamp(x(value), x.from, x.to); };
  for (std::size_t k = 0; k < row.marks.size(); ++k) {
    if (!std::isfinite(row.marks[k])) continue;
    if (k == 0)
      canvas.diamond({inside(row.marks[k]), y}, 6, "paper-mark");
    else
      canvas.circle({inside(row.marks[k]), y}, 4, "worst-mark");
  }
  if (chart.bars) return canvas.rect({x.from, y - 6, inside(row.value) - x.from, 12}, "bar");
  if (std::isfinite(row.low) && std::isfinite(row.high)) {
    canvas.line({inside(row.low), y}, {inside(row.high), y}, "interval");
    for (const double end : {row.low, row.high})
      canvas.line({inside(end), y - 4}, {inside(end), y + 4}, "interval");
  }
  canvas.circle({inside(row.value), y}, 5, "mark");
}

std::vector<Key> keys_of(const Rows& chart) {
  std::vector<Key> out;
  out.push_back({chart.value_name, [&](Canvas& canvas, Point at) {
                   if (chart.bars)
                     canvas.rect({at.x, at.y - 4, 16, 8}, "bar");
                   else
                     canvas.circle({at.x + 8, at.y}, 5, "mark");
                 }});
  for (std::size_t k = 0; k < chart.mark_names.size(); ++k)
    if (!chart.mark_names[k].empty())
      out.push_back({chart.mark_names[k], [k](Canvas& canvas, Point at) {
                       if (k == 0)
                         canvas.diamond({at.x + 8, at.y}, 6, "paper-mark");
                       else
                         canvas.circle({at.x + 8, at.y}, 4, "worst-mark");
                     }});
  if (std::isfinite(chart.limit))
    out.push_back({chart.limit_name, [](Canvas& canvas, Point at) {
                     canvas.line(at, {at.x + 16, at.y}, "limit");
                   }});
  return out;
}

std::vector<double> values_of(const Rows& chart) {
  std::vector<double> out{chart.limit};
  for (const Row& row : chart.rows) {
    out.insert(out.end(), {row.value, row.low, row.high});
    out.insert(out.end(), row.marks.begin(), row.marks.end());
  }
  return out;
}

}  // namespace

std::string draw(const Cells& chart) {
  const Grid grid = grid_of(chart);
  double width = grid.left + grid.width + grid.notes + cell_edge;
  width = std::max({width, svg::text_width(chart.title, text::panel) + 2 * cell_edge,
                    grid.left + svg::text_width(chart.x_title, text::axis) + cell_edge});
  const double height =
      grid.top + std::max(grid.height, svg::text_width(chart.y_title, text::axis)) + cell_edge;
  Sheet sheet(width, height, chart.words, "heat", true);
  sheet.write({cell_edge, 15}, chart.title, text::panel);
  sheet.write({grid.left, (chart.title.empty() ? 0 : 22) + 13.0}, chart.x_title, text::axis);
  sheet.write({14, grid.top}, chart.y_title, text::axis, Anchor::end, true);
  sheet.canvas.rect({grid.left, grid.top, grid.width, grid.height}, "cell-empty");
  for (const Cell& cell : chart.cells)
    draw_cell(sheet, cell,
              {grid.left + static_cast<double>(cell.column) * grid.cell_width + 0.5,
               grid.top + static_cast<double>(cell.row) * grid.cell_height + 0.5,
               grid.cell_width - 1, grid.cell_height - 1});
  name_grid(sheet, chart, grid);
  return sheet.canvas.finish();
}

std::string draw(const Rows& chart) {
  constexpr double row_height = 22;
  std::vector<std::string> names;
  for (const Row& row : chart.rows) names.push_back(row.name);
  const auto shown = svg::shorten_labels(names, chart.width * 0.4, text::row);
  const std::vector<Key> keys = keys_of(chart);
  const double left = svg::widest(shown, text::row) + 2 * cell_gap,
               top = legend_height(keys, chart.width) + 4;
  const Box area{left, top, chart.width - left - 22,
                 row_height * static_cast<double>(names.size())};
  Sheet sheet(chart.width, top + area.height + x_axis_height(chart.x, area.width) + 2, chart.words,
              chart.width < 600 ? "plot narrow" : "plot");
  draw_legend(sheet, keys, 2, chart.width - 4);
  const svg::Scale x{range_of(chart.x, values_of(chart)), left, left + area.width,
                     chart.x.logarithmic};
  draw_x_axis(sheet, area, x, chart.x);
  if (std::isfinite(chart.limit))
    sheet.canvas.line({x(chart.limit), top}, {x(chart.limit), top + area.height}, "limit");
  for (std::size_t r = 0; r < chart.rows.size(); ++r) {
    const double y = top + (static_cast<double>(r) + 0.5) * row_height;
    sheet.write({left - cell_gap, y + 4}, shown[r], text::row, Anchor::end, false, names[r]);
    draw_row(sheet, chart, chart.rows[r], x, y);
  }
  return sheet.canvas.finish();
}

std::string draw(const Maps& maps) {
  constexpr double width = 1000, picture = 116, step = 128, head = 18, foot = 16;
  constexpr auto columns = static_cast<std::size_t>(width / step);
  if (maps.tiles.empty()) return {};
  const bool has_notes =
      std::ranges::any_of(maps.tiles, [](const Tile& t) { return !t.note.empty(); });
  const double row_height = head + picture + (has_notes ? foot : 0) + cell_gap;
  const std::size_t rows = (maps.tiles.size() + columns - 1) / columns;
  std::vector<std::string> titles;
  for (const Tile& tile : maps.tiles) titles.push_back(tile.title);
  const auto shown = svg::shorten_labels(titles, picture, text::tick);
  Sheet sheet(width, row_height * static_cast<double>(rows), maps.words, "plot");
  for (std::size_t i = 0; i < maps.tiles.size(); ++i) {
    const double x = static_cast<double>(i % columns) * step + 2;
    const double y = static_cast<double>(i / columns) * row_height;
    sheet.write({x, y + 13}, shown[i], text::tick, Anchor::start, false, titles[i]);
    draw_tile(sheet.canvas, maps.tiles[i], {x, y + head, picture, picture});
    sheet.write_within(picture, {x, y + head + picture + 13}, maps.tiles[i].note, text::tick);
  }
  return sheet.canvas.finish();
}

std::string draw(const Shares& shares) {
  constexpr double width = 760;
  double total = 0;
  for (const auto& [name, part] : shares.parts) total += part;
  Sheet sheet(width, 44, shares.words, "plot");
  double x = 0;
  for (std::size_t i = 0; i < shares.parts.size() && total > 0; ++i) {
    const double share = shares.parts[i].second / total, part = share * width;
    const std::string shown = percent(share, 0) + " %";
    sheet.canvas.rect({x, 6, std::max(0.0, part - 1), 32},
                      "share share-" + std::to_string(i % 4 + 1));
    if (svg::text_width(shown, text::share) < part)
      sheet.write({x + part / 2, 27}, shown, text::share, Anchor::middle);
    x += part;
  }
  return sheet.canvas.finish();
}

std::string draw(const Chart& chart) {
  return std::visit([](const auto& one) { return draw(one); }, chart);
}

}  // namespace weft::daemon::chart
