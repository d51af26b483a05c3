#pragma once
// Random choices that are equal with every compiler: the standard fixes mt19937_64, but neither
// std::shuffle nor its distributions.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace weft::classifier {

using RandomEngine = std::mt19937_64;

/// Uniform on 0 .. count - 1, without bias; count > 0.
inline std::size_t random_below(RandomEngine& engine, std::size_t count) {
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t limit = most - most % count;
  std::uint64_t draw = engine();
  while (draw >= limit) draw = engine();
  return static_cast<std::size_t>(draw % count);
}

/// Uniform on [0, 1), in steps of 2^-53.
inline double random_unit(RandomEngine& engine) {
  return static_cast<double>(engine() >> 11U) * 0x1p-53;
}

/// Fisher-Yates shuffle.
template <class T>
void shuffle(std::vector<T>& items, RandomEngine& engine) {
  for (std::size_t i = items.size(); i > 1; --i) {
    std::swap(items[i - 1], items[random_below(engine, i)]);
  }
}

}  // namespace weft::classifier
