#include "classifier/design/cell_rule.hpp"

#include <algorithm>
#include <cmath>

#include "classifier/base/interval.hpp"

namespace weft::classifier::design {
namespace {

bool beats(const CellFigures& a, const CellFigures& b) {
  if (a.accuracy > b.accuracy) return !takes_less(b, a);
  return a.accuracy == b.accuracy && takes_less(a, b);
}

}  // namespace

double seconds_tolerance(const CellFigures& a, const CellFigures& b) {
  return std::max(equal_seconds_share * std::min(a.seconds, b.seconds),
                  z95 * std::hypot(a.seconds_error, b.seconds_error));
}

bool takes_less(const CellFigures& a, const CellFigures& b) {
  return b.seconds - a.seconds > seconds_tolerance(a, b);
}

double standard_error(double accuracy, double asked) {
  const double p = (accuracy * asked + 0.5) / (asked + 1);
  return std::sqrt(p * (1 - p) / asked);
}

std::size_t take(std::span<const CellFigures> cells, double asked) {
  const double best = std::ranges::max(cells, {}, &CellFigures::accuracy).accuracy;
  const double enough = best - standard_error(best, asked);
  const CellFigures* quickest = nullptr;
  for (const CellFigures& cell : cells)
    if (cell.accuracy >= enough && (quickest == nullptr || cell.seconds < quickest->seconds))
      quickest = &cell;
  const CellFigures* taken = quickest;
  for (const CellFigures& cell : cells)
    if (cell.accuracy >= enough && !takes_less(*quickest, cell) && cell.snr_db > taken->snr_db)
      taken = &cell;
  return static_cast<std::size_t>(taken - cells.data());
}

std::vector<std::size_t> front_of(std::span<const CellFigures> cells) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (std::ranges::none_of(cells, [&](const CellFigures& c) { return beats(c, cells[i]); }))
      out.push_back(i);
  std::ranges::stable_sort(out, {}, [&](std::size_t i) { return cells[i].seconds; });
  return out;
}

}  // namespace weft::classifier::design
