#include "daemon/pages/plot/heat_map.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {
namespace {

using classifier::Confusion;

constexpr double left_edge = 76, top_edge = 74, edge = 6;

std::size_t row_sum(const Confusion& confusion, std::size_t row) {
  std::size_t sum = 0;
  for (std::size_t k = 0; k < confusion.classes(); ++k) sum += confusion.at(row, k);
  return sum;
}

double share_of_row(const Confusion& confusion, std::size_t truth, std::size_t predicted) {
  const std::size_t sum = row_sum(confusion, truth);
  return sum == 0 ? 0
                  : static_cast<double>(confusion.at(truth, predicted)) / static_cast<double>(sum);
}

// The root, so that a single mistake among hundreds is still seen; the same on and off the
// diagonal, so that both colours compare.
double shade(double share) {
  return 0.12 + 0.88 * std::sqrt(share);
}

void draw_cell(svg::Canvas& canvas, const Confusion& confusion, std::size_t truth,
               std::size_t predicted, const svg::Box& box) {
  const std::size_t count = confusion.at(truth, predicted);
  const bool diagonal = truth == predicted;
  if (count == 0) {
    canvas.rect(box, diagonal ? "cell-diagonal" : "cell-empty");
    return;
  }
  const double opacity = shade(share_of_row(confusion, truth, predicted));
  canvas.rect(box, diagonal ? "cell-hit" : "cell-miss", opacity);
  const double middle = box.x + box.width / 2;
  canvas.text({middle, box.y + box.height / 2 + 3.5}, std::to_string(count),
              opacity > 0.72 ? "cell-text on" : "cell-text", svg::Anchor::middle);
}

struct Mistake {
  std::size_t truth;
  std::size_t predicted;
  std::size_t count;
};

std::vector<Mistake> list_mistakes(const Confusion& confusion) {
  std::vector<Mistake> out;
  for (std::size_t t = 0; t < confusion.classes(); ++t)
    for (std::size_t p = 0; p < confusion.classes(); ++p)
      if (t != p && confusion.at(t, p) > 0) out.push_back({t, p, confusion.at(t, p)});
  std::stable_sort(out.begin(), out.end(),
                   [](const Mistake& a, const Mistake& b) { return a.count > b.count; });
  return out;
}

}  // namespace

std::string confusion_map(const Confusion& confusion, std::string_view title) {
  const std::size_t n = confusion.classes();
  const double cell = n > 24 ? 18 : n > 10 ? 25 : 36;
  const double side = cell * static_cast<double>(n);
  svg::Canvas canvas(left_edge + side + edge, top_edge + side + 26, title, "heat");
  for (std::size_t i = 0; i < n; ++i) {
    const double centre = (static_cast<double>(i) + 0.5) * cell;
    canvas.text({left_edge - 6, top_edge + centre + 4}, confusion.labels[i], "tick",
                svg::Anchor::end);
    canvas.text({left_edge + centre + 4, top_edge - 6}, confusion.labels[i], "tick",
                svg::Anchor::start, true);
    for (std::size_t k = 0; k < n; ++k)
      draw_cell(canvas, confusion, i, k,
                {left_edge + static_cast<double>(k) * cell + 0.5,
                 top_edge + centre - cell / 2 + 0.5, cell - 1, cell - 1});
  }
  canvas.text({left_edge + side / 2, top_edge + side + 18}, "columns: taken for; rows: true fabric",
              "axis-title", svg::Anchor::middle);
  return canvas.finish();
}

std::string worst_confusions(const Confusion& confusion, std::size_t count) {
  const std::vector<Mistake> mistakes = list_mistakes(confusion);
  if (mistakes.empty()) return "No trial was taken for another fabric.";
  std::string out = "Most frequent: ";
  for (std::size_t i = 0; i < std::min(count, mistakes.size()); ++i) {
    const Mistake& m = mistakes[i];
    if (i > 0) out += "; ";
    out += confusion.labels[m.truth] + " taken for " + confusion.labels[m.predicted] + " " +
           thousands(m.count) + (m.count == 1 ? " time" : " times") + " (" +
           percent(share_of_row(confusion, m.truth, m.predicted)) + " %)";
  }
  return out + ".";
}

}  // namespace weft::daemon
