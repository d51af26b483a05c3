#include "classifier/learn/folds.hpp"

#include <algorithm>

#include "classifier/learn/random.hpp"

namespace weft::classifier {

std::vector<Fold> stratified_folds(std::span<const int> sign, std::size_t folds,
                                   std::uint64_t seed) {
  RandomEngine engine(seed);
  std::vector<std::size_t> positive, negative;
  for (std::size_t i = 0; i < sign.size(); ++i) (sign[i] > 0 ? positive : negative).push_back(i);
  const std::size_t k = std::min({folds, positive.size(), negative.size()});
  shuffle(positive, engine);
  shuffle(negative, engine);
  // Dealt like cards, one class after the other without a restart: 8 + 8 rows in 5 folds give
  // 4,3,3,3,3.
  std::vector<std::size_t> fold_of(sign.size());
  std::size_t dealt = 0;
  for (const auto* rows : {&positive, &negative}) {
    for (const std::size_t row : *rows) fold_of[row] = dealt++ % k;
  }
  std::vector<Fold> out(k);
  for (std::size_t i = 0; i < sign.size(); ++i) {
    for (std::size_t f = 0; f < k; ++f) {
      (fold_of[i] == f ? out[f].validate : out[f].train).push_back(i);
    }
  }
  return out;
}

}  // namespace weft::classifier
