#include "classifier/learn/folds.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "classifier/base/matrix.hpp"
#include "classifier/base/random.hpp"

namespace weft::classifier {
namespace {

// The units with a row of either class, in order of first appearance, and whether they have both.
struct Units {
  std::vector<std::size_t> mixed;
  std::vector<std::size_t> positive;
  std::vector<std::size_t> negative;
};

Units units_of(std::span<const int> sign, std::span<const std::size_t> unit) {
  std::map<std::size_t, std::array<bool, 2>> has;
  for (std::size_t i = 0; i < sign.size(); ++i) has[unit[i]][sign[i] > 0 ? 1 : 0] = true;
  Units out;
  for (const std::size_t u : unit) {
    auto& [negative, positive] = has[u];
    if (!negative && !positive) continue;  // seen
    (negative && positive ? out.mixed : positive ? out.positive : out.negative).push_back(u);
    negative = positive = false;
  }
  return out;
}

// Deals units into k folds, each to the fold that has the fewest units of its class or classes,
// then the fewest in all. Units of both classes go first and so to different folds; a class with at
// most one of them then finds folds without it. Hence a class of two or more units is in two or
// more folds, and every training part has both classes.
class Assigner {
 public:
  explicit Assigner(std::size_t folds) : held_(folds) {}

  void deal(const std::vector<std::size_t>& units, bool positive, bool negative) {
    for (const std::size_t u : units) {
      const auto load = [&](const Held& h) {
        return std::pair((positive ? h.positive : 0) + (negative ? h.negative : 0), h.units);
      };
      const auto least =
          std::min_element(held_.begin(), held_.end(),
                           [&](const Held& a, const Held& b) { return load(a) < load(b); });
      least->positive += positive ? 1 : 0;
      least->negative += negative ? 1 : 0;
      ++least->units;
      fold_of_.emplace(u, static_cast<std::size_t>(least - held_.begin()));
    }
  }

  [[nodiscard]] std::size_t fold_of(std::size_t unit) const { return fold_of_.at(unit); }

 private:
  struct Held {
    std::size_t positive = 0, negative = 0, units = 0;
  };
  std::vector<Held> held_;
  std::map<std::size_t, std::size_t> fold_of_;
};

std::vector<Fold> gather(const std::vector<std::size_t>& fold_of_row, std::size_t folds) {
  std::vector<Fold> out(folds);
  for (std::size_t i = 0; i < fold_of_row.size(); ++i) {
    for (std::size_t f = 0; f < folds; ++f) {
      (fold_of_row[i] == f ? out[f].validate : out[f].train).push_back(i);
    }
  }
  return out;
}

std::vector<Fold> leave_one_out(std::span<const std::size_t> unit) {
  std::map<std::size_t, std::size_t> number;
  std::vector<std::size_t> fold_of_row;
  for (const std::size_t u : unit)
    fold_of_row.push_back(number.emplace(u, number.size()).first->second);
  return gather(fold_of_row, number.size());
}

// A pooled t-test inside the fold needs three rows: with two it has no degree of freedom.
bool large_enough(const std::vector<Fold>& folds) {
  return std::all_of(folds.begin(), folds.end(),
                     [](const Fold& fold) { return fold.train.size() >= least_fold_rows; });
}

}  // namespace

std::vector<Fold> stratified_folds(std::span<const int> sign, std::span<const std::size_t> unit,
                                   std::size_t folds, std::uint64_t seed) {
  Units units = units_of(sign, unit);
  const std::size_t k = std::min({folds, units.mixed.size() + units.positive.size(),
                                  units.mixed.size() + units.negative.size()});
  if (k < 2) return stratified_folds(sign, numbers_below(sign.size()), folds, seed);
  RandomEngine engine(seed);
  for (auto* list : {&units.positive, &units.negative, &units.mixed}) shuffle(*list, engine);
  Assigner assigner(k);
  assigner.deal(units.mixed, true, true);
  assigner.deal(units.positive, true, false);
  assigner.deal(units.negative, false, true);
  std::vector<std::size_t> fold_of_row;
  for (const std::size_t u : unit) fold_of_row.push_back(assigner.fold_of(u));
  std::vector<Fold> out = gather(fold_of_row, k);
  if (!large_enough(out)) out = leave_one_out(unit);
  if (!large_enough(out)) out = leave_one_out(numbers_below(sign.size()));
  return out;
}

}  // namespace weft::classifier
