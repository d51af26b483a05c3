#include "classifier/learn/folds.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "classifier/learn/random.hpp"

namespace weft::classifier {
namespace {

// Distinct units with a row of the wanted class, in order of first appearance.
std::vector<std::size_t> units_of(std::span<const int> sign, std::span<const std::size_t> unit,
                                  bool positive) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < sign.size(); ++i) {
    if ((sign[i] > 0) != positive) continue;
    if (std::find(out.begin(), out.end(), unit[i]) == out.end()) out.push_back(unit[i]);
  }
  return out;
}

}  // namespace

std::vector<Fold> stratified_folds(std::span<const int> sign, std::span<const std::size_t> unit,
                                   std::size_t folds, std::uint64_t seed) {
  std::vector<std::size_t> positive = units_of(sign, unit, true);
  std::vector<std::size_t> negative = units_of(sign, unit, false);
  const std::size_t k = std::min({folds, positive.size(), negative.size()});
  if (k < 2) {
    std::vector<std::size_t> single(sign.size());
    std::iota(single.begin(), single.end(), std::size_t{0});
    return stratified_folds(sign, single, folds, seed);
  }
  RandomEngine engine(seed);
  shuffle(positive, engine);
  shuffle(negative, engine);
  // Dealt like cards, one class after the other without a restart: 8 + 8 trials in 5 folds give
  // 4,3,3,3,3.
  std::map<std::size_t, std::size_t> fold_of;
  for (const auto* units : {&positive, &negative}) {
    for (const std::size_t u : *units) fold_of.emplace(u, fold_of.size() % k);
  }
  std::vector<Fold> out(k);
  for (std::size_t i = 0; i < sign.size(); ++i) {
    for (std::size_t f = 0; f < k; ++f) {
      (fold_of[unit[i]] == f ? out[f].validate : out[f].train).push_back(i);
    }
  }
  return out;
}

}  // namespace weft::classifier
