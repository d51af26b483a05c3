#include "classifier/baseline/class_folds.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>

#include "classifier/learn/random.hpp"

namespace weft::classifier {
namespace {

using RowsOfClass = std::map<std::size_t, std::size_t>;  // class -> rows

struct Unit {
  std::vector<std::size_t> rows;
  RowsOfClass held;
};

std::vector<Unit> gather_units(std::span<const std::size_t> of_row,
                               std::span<const std::size_t> unit) {
  std::map<std::size_t, std::size_t> place;
  std::vector<Unit> out;
  for (std::size_t r = 0; r < unit.size(); ++r) {
    const std::size_t at = place.emplace(unit[r], out.size()).first->second;
    if (at == out.size()) out.emplace_back();
    out[at].rows.push_back(r);
    ++out[at].held[of_row[r]];
  }
  return out;
}

// Units of one class after the other, so that each class is spread by itself; each unit goes to the
// fold with the fewest rows of its first class, then the fewest in all.
std::vector<std::size_t> deal(const std::vector<Unit>& units, std::size_t rows, std::size_t folds) {
  std::vector<std::size_t> order(units.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto first_class = [&](std::size_t u) { return units[u].held.begin()->first; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return first_class(a) < first_class(b); });
  std::vector<RowsOfClass> held(folds);
  std::vector<std::size_t> size(folds), fold_of_row(rows);
  for (const std::size_t u : order) {
    std::size_t to = 0;
    const auto load = [&](std::size_t f) { return std::tuple(held[f][first_class(u)], size[f]); };
    for (std::size_t f = 1; f < folds; ++f)
      if (load(f) < load(to)) to = f;
    for (const auto& [c, count] : units[u].held) held[to][c] += count;
    size[to] += units[u].rows.size();
    for (const std::size_t r : units[u].rows) fold_of_row[r] = to;
  }
  return fold_of_row;
}

std::vector<Fold> as_folds(const std::vector<std::size_t>& fold_of_row, std::size_t folds) {
  std::vector<Fold> out(folds);
  for (std::size_t r = 0; r < fold_of_row.size(); ++r)
    for (std::size_t f = 0; f < folds; ++f)
      (fold_of_row[r] == f ? out[f].validate : out[f].train).push_back(r);
  std::erase_if(out, [](const Fold& fold) { return fold.validate.empty(); });
  return out;
}

bool usable(const std::vector<Fold>& folds, std::span<const std::size_t> of_row) {
  const std::size_t classes = std::set<std::size_t>(of_row.begin(), of_row.end()).size();
  return folds.size() >= 2 && std::all_of(folds.begin(), folds.end(), [&](const Fold& fold) {
           RowsOfClass rows;
           for (const std::size_t r : fold.train) ++rows[of_row[r]];
           return rows.size() == classes &&
                  std::all_of(rows.begin(), rows.end(),
                              [](const auto& c) { return c.second >= 2; });
         });
}

// The fewest units that any class has.
std::size_t units_of_rarest(const std::vector<Unit>& units) {
  RowsOfClass count;
  for (const Unit& unit : units)
    for (const auto& entry : unit.held) ++count[entry.first];
  std::size_t out = units.size();
  for (const auto& entry : count) out = std::min(out, entry.second);
  return out;
}

std::vector<Fold> folds_of(std::span<const std::size_t> of_row, std::span<const std::size_t> unit,
                           std::size_t folds, std::uint64_t seed) {
  std::vector<Unit> units = gather_units(of_row, unit);
  const std::size_t k = std::min(folds, units_of_rarest(units));
  if (k < 2) return {};
  RandomEngine engine(seed);
  shuffle(units, engine);
  std::vector<Fold> out = as_folds(deal(units, of_row.size(), k), k);
  return usable(out, of_row) ? out : std::vector<Fold>{};
}

}  // namespace

Classes classes_of(const FeatureMatrix& matrix) {
  const std::set<std::string> distinct(matrix.labels.begin(), matrix.labels.end());
  Classes out{{distinct.begin(), distinct.end()}, {}};
  for (const std::string& label : matrix.labels)
    out.of_row.push_back(static_cast<std::size_t>(
        std::lower_bound(out.labels.begin(), out.labels.end(), label) - out.labels.begin()));
  return out;
}

std::vector<Fold> class_folds(std::span<const std::size_t> of_row,
                              std::span<const std::size_t> unit, std::size_t folds,
                              std::uint64_t seed) {
  std::vector<Fold> out = folds_of(of_row, unit, folds, seed);
  if (!out.empty()) return out;
  std::vector<std::size_t> single(of_row.size());
  std::iota(single.begin(), single.end(), std::size_t{0});
  return folds_of(of_row, single, folds, seed);
}

}  // namespace weft::classifier
