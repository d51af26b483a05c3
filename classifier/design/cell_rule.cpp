#include "classifier/design/cell_rule.hpp"

#include <algorithm>
#include <cmath>

#include "classifier/base/interval.hpp"

namespace weft::classifier::design {
namespace {

bool beats(const CellStatistics& a, const CellStatistics& b) {
  if (a.accuracy > b.accuracy) return !is_cheaper(b, a);
  return a.accuracy == b.accuracy && is_cheaper(a, b);
}

}  // namespace

double seconds_tolerance(const CellStatistics& a, const CellStatistics& b) {
  return std::max(equal_seconds_share * std::min(a.seconds, b.seconds),
                  z95 * std::hypot(a.seconds_error, b.seconds_error));
}

bool is_cheaper(const CellStatistics& a, const CellStatistics& b) {
  return b.seconds - a.seconds > seconds_tolerance(a, b);
}

double standard_error(double accuracy, double requested) {
  const double p = (accuracy * requested + 0.5) / (requested + 1);
  return std::sqrt(p * (1 - p) / requested);
}

std::size_t take(std::span<const CellStatistics> cells, double requested) {
  const double best = std::ranges::max(cells, {}, &CellStatistics::accuracy).accuracy;
  const double enough = best - standard_error(best, requested);
  const CellStatistics* quickest = nullptr;
  for (const CellStatistics& cell : cells)
    if (cell.accuracy >= enough && (quickest == nullptr || cell.seconds < quickest->seconds))
      quickest = &cell;
  const CellStatistics* taken = quickest;
  for (const CellStatistics& cell : cells)
    if (cell.accuracy >= enough && !is_cheaper(*quickest, cell) && cell.snr_db > taken->snr_db)
      taken = &cell;
  return static_cast<std::size_t>(taken - cells.data());
}

std::vector<std::size_t> find_front(std::span<const CellStatistics> cells) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (std::ranges::none_of(cells, [&](const CellStatistics& c) { return beats(c, cells[i]); }))
      out.push_back(i);
  std::ranges::stable_sort(out, {}, [&](std::size_t i) { return cells[i].seconds; });
  return out;
}

}  // namespace weft::classifier::design
