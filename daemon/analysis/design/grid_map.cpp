#include "daemon/analysis/design/grid_map.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {
namespace {

struct Margins {
  double left = 62, top = 22, bottom = 40, right = 8;
};
struct CellSize {
  double width = 96, height = 38;
};
constexpr Margins margins;
constexpr CellSize cell_size;
constexpr double lightest = 0.1, darkest = 0.95, light_on_dark = 0.72;

struct Values {
  double least = HUGE_VAL, most = -HUGE_VAL;
  [[nodiscard]] double shade(double value) const {
    return most > least ? lightest + (darkest - lightest) * (value - least) / (most - least)
                        : (lightest + darkest) / 2;
  }
};

Values values_of(const GridMap& map) {
  Values out;
  for (const auto& row : map.cells)
    for (const auto& cell : row) {
      if (!cell) continue;
      out.least = std::min(out.least, cell->value);
      out.most = std::max(out.most, cell->value);
    }
  return out;
}

void draw(svg::Canvas& canvas, const GridCell& cell, double shade, const svg::Box& box) {
  canvas.rect(box, "cell-hit", shade);
  const char* const on = shade > light_on_dark ? "cell-text on" : "cell-text";
  const double middle = box.x + box.width / 2;
  canvas.text({middle, box.y + 16}, cell.words, on, svg::Anchor::middle);
  canvas.text({middle, box.y + 30}, cell.second, on, svg::Anchor::middle);
  if (cell.marked) canvas.diamond({box.x + 9, box.y + 9}, 5, on);
}

}  // namespace

std::string grid_map(const GridMap& map) {
  const auto columns = static_cast<double>(map.x.size()), rows = static_cast<double>(map.y.size());
  svg::Canvas canvas(margins.left + columns * cell_size.width + margins.right,
                     margins.top + rows * cell_size.height + margins.bottom, map.title, "heat");
  canvas.text({margins.left, 14}, map.stamp, "axis-title");
  const Values values = values_of(map);
  for (std::size_t r = 0; r < map.y.size(); ++r) {
    const double y = margins.top + (rows - 1 - static_cast<double>(r)) * cell_size.height;
    canvas.text({margins.left - 6, y + cell_size.height / 2 + 4}, map.y[r], "tick",
                svg::Anchor::end);
    for (std::size_t c = 0; c < map.x.size(); ++c) {
      const svg::Box box{margins.left + static_cast<double>(c) * cell_size.width + 0.5, y + 0.5,
                         cell_size.width - 1, cell_size.height - 1};
      if (map.cells[r][c])
        draw(canvas, *map.cells[r][c], values.shade(map.cells[r][c]->value), box);
      else
        canvas.rect(box, "cell-empty");
    }
  }
  for (std::size_t c = 0; c < map.x.size(); ++c)
    canvas.text({margins.left + (static_cast<double>(c) + 0.5) * cell_size.width,
                 margins.top + rows * cell_size.height + 15},
                map.x[c], "tick", svg::Anchor::middle);
  canvas.text(
      {margins.left + columns * cell_size.width / 2, margins.top + rows * cell_size.height + 32},
      map.x_title, "axis-title", svg::Anchor::middle);
  canvas.text({12, margins.top + rows * cell_size.height / 2}, map.y_title, "axis-title",
              svg::Anchor::middle, true);
  return canvas.finish();
}

}  // namespace weft::daemon
