#include "daemon/pages/document/confusion.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace weft::daemon {
namespace {

using classifier::Confusion;

constexpr std::size_t most_with_shares = 10;  // labels; each cell has a second line

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

// The root makes a single error among hundreds visible. It is the same on and off the diagonal, so
// that both colours compare.
double shade_of(double share) {
  return 0.12 + 0.88 * std::sqrt(share);
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
  std::ranges::stable_sort(out, std::greater{}, &Mistake::count);
  return out;
}

}  // namespace

chart::Cells confusion_cells(const Confusion& confusion, std::string_view title,
                             const std::vector<std::size_t>& order) {
  chart::Cells out;
  out.words = title;
  out.x_title = "predicted label";
  out.y_title = "true label";
  out.notes_title = "right";
  for (std::size_t r = 0; r < order.size(); ++r) {
    out.rows.push_back(confusion.labels[order[r]]);
    out.row_notes.push_back(row_sum(confusion, order[r]) == 0
                                ? std::string(no_value)
                                : percent(share_of_row(confusion, order[r], order[r]), 0) + " %");
    for (std::size_t c = 0; c < order.size(); ++c) {
      const std::size_t count = confusion.at(order[r], order[c]);
      if (count == 0) continue;
      const double share = share_of_row(confusion, order[r], order[c]);
      out.cells.push_back({r, c, std::to_string(count),
                           order.size() <= most_with_shares ? percent(share, 0) + " %" : "",
                           std::round(shade_of(share) * 100) / 100,
                           r == c ? chart::CellKind::hit : chart::CellKind::miss});
    }
  }
  out.columns = out.rows;
  return out;
}

std::vector<std::size_t> order_by_errors(const Confusion& confusion) {
  std::vector<std::size_t> out(confusion.classes());
  std::iota(out.begin(), out.end(), std::size_t{0});
  std::ranges::stable_sort(out, std::greater{}, [&](std::size_t row) {
    return row_sum(confusion, row) - confusion.at(row, row);
  });
  return out;
}

Blocks confusion_pictures(const Confusion& confusion, std::string_view title) {
  if (confusion.classes() == 0) return {};
  std::vector<std::size_t> order(confusion.classes());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Blocks out = picture(confusion_cells(confusion, title, order));
  const std::vector<std::size_t> by_errors = order_by_errors(confusion);
  if (by_errors != order)
    out += details(
        "Sorted by errors",
        picture(confusion_cells(confusion, std::string(title) + ", sorted by errors", by_errors)));
  return out;
}

std::string worst_confusions(const Confusion& confusion, std::size_t count) {
  const std::vector<Mistake> mistakes = list_mistakes(confusion);
  if (mistakes.empty()) return "No wrong predictions.";
  std::string out = "Most frequent errors: ";
  for (std::size_t i = 0; i < std::min(count, mistakes.size()); ++i) {
    const Mistake& m = mistakes[i];
    if (i > 0) out += "; ";
    out += confusion.labels[m.truth] + " predicted as " + confusion.labels[m.predicted] + " " +
           thousands(m.count) + (m.count == 1 ? " time" : " times") + " (" +
           percent(share_of_row(confusion, m.truth, m.predicted)) + " %)";
  }
  return out + ".";
}

}  // namespace weft::daemon
