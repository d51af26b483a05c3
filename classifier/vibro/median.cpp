#include "classifier/vibro/median.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "classifier/features/lanes.hpp"

namespace weft::classifier::vibro {
namespace {

using simd::Lanes;
using Integers = std::int64_t __attribute__((vector_size(simd::width * sizeof(std::int64_t))));

constexpr std::size_t few = 24;         // are picked out
constexpr std::size_t most_rounds = 8;  // of counting alone; values of a few kinds need more
constexpr double infinity = std::numeric_limits<double>::infinity();
// Each group of eight of a round has sums of its own, so that none waits for the one before.
constexpr std::size_t chains = 4, round_size = chains * simd::width;

// Values of whole rounds below a pivot.
WEFT_CLONES("arch=x86-64-v4", "avx2")
std::size_t count_rounds(const double* values, std::size_t count, double pivot) {
  const Lanes at = simd::all<Lanes>(pivot);
  Integers below[chains] = {};
  for (std::size_t i = 0; i < count; i += round_size)
    for (std::size_t c = 0; c < chains; ++c)
      below[c] -= simd::load(values + i + c * simd::width) < at;
  std::size_t out = 0;
  for (const Integers& own : below)
    for (std::size_t k = 0; k < simd::width; ++k) out += static_cast<std::size_t>(own[k]);
  return out;
}

std::size_t count_below(std::span<const double> values, double pivot) {
  const std::size_t whole = values.size() / round_size * round_size;
  std::size_t out = count_rounds(values.data(), whole, pivot);
  for (const double v : values.subspan(whole)) out += v < pivot ? 1 : 0;
  return out;
}

// What lies on either side of a pivot.
struct Sides {
  double below_most = -infinity;              // the largest less than it
  double least = infinity, most = -infinity;  // of the others
};

// Of groups of eight, as many as there are whole ones.
WEFT_CLONES("arch=x86-64-v4", "avx2")
Sides part_groups(const double* values, std::size_t count, double pivot) {
  const Lanes at = simd::all<Lanes>(pivot), low = simd::all<Lanes>(-infinity),
              high = simd::all<Lanes>(infinity);
  Lanes below_most = low, least = high, most = low;
  for (std::size_t i = 0; i < count; i += simd::width) {
    const Lanes v = simd::load(values + i);
    below_most = simd::larger<Lanes>(below_most, v < at ? v : low);
    least = simd::smaller<Lanes>(least, v < at ? high : v);
    most = simd::larger<Lanes>(most, v < at ? low : v);
  }
  Sides out;
  for (std::size_t k = 0; k < simd::width; ++k) {
    out.below_most = std::max(out.below_most, below_most[k]);
    out.least = std::min(out.least, least[k]);
    out.most = std::max(out.most, most[k]);
  }
  return out;
}

Sides part(std::span<const double> values, double pivot) {
  const std::size_t whole = values.size() / simd::width * simd::width;
  Sides out = part_groups(values.data(), whole, pivot);
  for (const double v : values.subspan(whole)) {
    if (v < pivot) {
      out.below_most = std::max(out.below_most, v);
    } else {
      out.least = std::min(out.least, v);
      out.most = std::max(out.most, v);
    }
  }
  return out;
}

// Copies those from `low` to `high`, of which there are few: a round is passed over at once where
// it has none.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void pick(const double* values, std::size_t count, double low, double high,
          std::vector<double>& out) {
  const Lanes least = simd::all<Lanes>(low), most = simd::all<Lanes>(high);
  const auto take = [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k)
      if (values[k] >= low && values[k] <= high) out.push_back(values[k]);
  };
  std::size_t i = 0;
  for (; i + round_size <= count; i += round_size) {
    Integers within{};
    for (std::size_t c = 0; c < chains; ++c) {
      const Lanes v = simd::load(values + i + c * simd::width);
      within -= v >= least;
      within += v > most;
    }
    within += __builtin_shufflevector(within, within, 4, 5, 6, 7, 0, 1, 2, 3);
    within += __builtin_shufflevector(within, within, 2, 3, 0, 1, 6, 7, 4, 5);
    if (within[0] + within[1] != 0) take(i, i + round_size);
  }
  take(i, count);
}

// `before` values are below `low`; `up_to` are below `high`, or not above it where that is a value.
struct Bounds {
  double low, high;
  std::size_t before = 0, up_to;
  bool low_moved = false;

  // More than low, at most high. Values are taken to lie evenly; the pivot is a little beyond the
  // place of the one sought, away from the bound that moved last, so that both come near.
  [[nodiscard]] double pivot(std::size_t rank) const {
    const auto within = static_cast<double>(up_to - before);
    const double slack = 0.25 * std::sqrt(within);
    const double place = static_cast<double>(rank - before) + 1.0 + (low_moved ? slack : -slack);
    const double share = std::clamp(place / within, 0.05, 0.95);
    const double at = low * (1.0 - share) + high * share;
    return at > low && at <= high ? at : high;
  }
};

}  // namespace

// Both lie from `low` to `high`; `before` values are below.
MedianFinder::Pair MedianFinder::among(std::span<const double> values, double low, double high,
                                       std::size_t place) {
  picked_.clear();
  pick(values.data(), values.size(), low, high, picked_);
  const auto at = picked_.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(picked_.begin(), at, picked_.end());
  return {*at, at + 1 == picked_.end() ? *at : *std::min_element(at + 1, picked_.end())};
}

MedianFinder::Pair MedianFinder::by_counting(std::span<const double> values, std::size_t rank) {
  const Sides all = part(values, -infinity);
  Bounds bounds{.low = all.least, .high = all.most, .up_to = values.size()};
  for (std::size_t round = 0; bounds.low < bounds.high; ++round) {
    if (bounds.up_to - bounds.before <= few || round == 3 * most_rounds)
      return among(values, bounds.low, bounds.high, rank - bounds.before);
    const double pivot = bounds.pivot(rank);
    const std::size_t below = count_below(values, pivot);
    if (below == rank + 1) {  // the pivot lies between both
      const Sides sides = part(values, pivot);
      return {sides.below_most, sides.least};
    }
    bounds.low_moved = below <= rank;
    // Bounds that are values themselves leave at least one of a kind behind.
    const bool by_value = round >= most_rounds;
    if (bounds.low_moved) {
      bounds.low = by_value ? part(values, pivot).least : pivot;
      bounds.before = below;
    } else {
      bounds.high = by_value ? part(values, pivot).below_most : pivot;
      bounds.up_to = below;
    }
  }
  return {bounds.low, bounds.low};
}

double MedianFinder::median(std::span<const double> values) {
  if (values.empty()) return 0.0;
  const Pair pair = by_counting(values, (values.size() - 1) / 2);
  return values.size() % 2 == 1 ? pair.at : 0.5 * pair.at + 0.5 * pair.next;
}

}  // namespace weft::classifier::vibro
