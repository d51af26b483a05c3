#include "classifier/vibro/level_features.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace weft::classifier::vibro {
namespace {

using simd::Lanes;
using Integers = std::int64_t __attribute__((vector_size(simd::width * sizeof(std::int64_t))));

// Sum of the lanes; each includes its value of the rest after the last whole group.
template <class Term>
WEFT_INLINE double folded(Lanes sum, const double* rest, std::size_t count, Term term) {
  double out = 0.0;
  for (std::size_t k = 0; k < simd::width; ++k) out += k < count ? sum[k] + term(rest[k]) : sum[k];
  return out;
}

// Groups of eight go to this number of sums in turn, so that no addition waits for the one before.
constexpr std::size_t chains = 4, round_size = chains * simd::width;

// The sum of `term` over all values; `term` takes one value or eight.
template <class Term>
WEFT_INLINE double sum_over(const double* values, std::size_t count, Term term) {
  Lanes sum[chains] = {};
  std::size_t i = 0;
  for (; i + round_size <= count; i += round_size)
    for (std::size_t c = 0; c < chains; ++c)
      sum[c] += term(simd::load(values + i + c * simd::width));
  for (; i + simd::width <= count; i += simd::width) sum[0] += term(simd::load(values + i));
  return folded((sum[0] + sum[1]) + (sum[2] + sum[3]), values + i, count - i, term);
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
double add_up(const double* values, std::size_t count) {
  return sum_over(
      values, count, [](auto v) __attribute__((always_inline)) { return v; });
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
double add_deviations(const double* values, std::size_t count, double middle) {
  return sum_over(
      values, count, [=](auto v) __attribute__((always_inline)) {
        return v - simd::all<decltype(v)>(middle);
      });
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
double add_squares(const double* values, std::size_t count, double middle) {
  return sum_over(
      values, count, [=](auto v) __attribute__((always_inline)) {
        const auto away = v - simd::all<decltype(v)>(middle);
        return away * away;
      });
}

// Number of sign changes in the pairs (values[i], values[i + 1]), i < count.
WEFT_CLONES("arch=x86-64-v4", "avx2")
std::size_t count_changes(const double* values, std::size_t count) {
  const Lanes level = simd::all<Lanes>(-zero_level);
  Integers changes{};
  std::size_t i = 0;
  for (; i + simd::width <= count; i += simd::width) {
    const Integers here = simd::load(values + i) < level, next = simd::load(values + i + 1) < level;
    changes -= here ^ next;
  }
  std::size_t out = 0;
  for (std::size_t k = 0; k < simd::width; ++k) out += static_cast<std::size_t>(changes[k]);
  for (; i < count; ++i) out += (values[i] < -zero_level) != (values[i + 1] < -zero_level) ? 1 : 0;
  return out;
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void compute_deviations(const double* values, std::size_t count, double middle, double* out) {
  const Lanes off = simd::all<Lanes>(middle);
  std::size_t i = 0;
  for (; i + simd::width <= count; i += simd::width)
    simd::store(out + i, simd::magnitude<Lanes>(simd::load(values + i) - off));
  for (; i < count; ++i) out[i] = simd::magnitude<double>(values[i] - middle);
}

constexpr std::size_t few = 24;  // number of values that are copied
constexpr std::size_t most_alike =
    512;  // number of values that are copied if single precision cannot separate them
constexpr std::size_t most_rounds = 8;  // rounds of counting only; a few distinct values need more

// Vectors of 64 bytes of values, and of equally many integers of their size.
template <class T>
struct Vectors;
template <>
struct Vectors<double> {
  using Values = simd::Lanes;
  using Integers = std::int64_t __attribute__((vector_size(sizeof(Values))));
};
template <>
struct Vectors<float> {
  using Values = float __attribute__((vector_size(sizeof(simd::Lanes))));
  using Integers = std::int32_t __attribute__((vector_size(sizeof(Values))));
};

template <class T>
struct Wide : Vectors<T> {
  using Values = typename Vectors<T>::Values;
  static constexpr std::size_t width = sizeof(Values) / sizeof(T), round = chains * width;
  static constexpr T infinity = std::numeric_limits<T>::infinity();
  struct __attribute__((packed, may_alias)) Loose {
    Values value;
  };

  WEFT_INLINE static Values load(const T* p) { return reinterpret_cast<const Loose*>(p)->value; }
  WEFT_INLINE static Values all(T v) { return v - Values{}; }
};

// Number of values below a pivot; `count` is a multiple of a round.
template <class T>
WEFT_INLINE std::size_t count_in_rounds(const T* values, std::size_t count, T pivot) {
  using W = Wide<T>;
  const auto at = W::all(pivot);
  typename W::Integers below[chains] = {};
  for (std::size_t i = 0; i < count; i += W::round)
    for (std::size_t c = 0; c < chains; ++c) below[c] -= W::load(values + i + c * W::width) < at;
  std::size_t out = 0;
  for (const auto& own : below)
    for (std::size_t k = 0; k < W::width; ++k) out += static_cast<std::size_t>(own[k]);
  return out;
}
WEFT_CLONES("arch=x86-64-v4", "avx2")
std::size_t count_rounds(const double* values, std::size_t count, double pivot) {
  return count_in_rounds(values, count, pivot);
}
WEFT_CLONES("arch=x86-64-v4", "avx2")
std::size_t count_rounds(const float* values, std::size_t count, float pivot) {
  return count_in_rounds(values, count, pivot);
}

template <class T>
std::size_t count_below(std::span<const T> values, T pivot) {
  const std::size_t whole = values.size() / Wide<T>::round * Wide<T>::round;
  std::size_t out = count_rounds(values.data(), whole, pivot);
  for (const T v : values.subspan(whole)) out += v < pivot ? 1 : 0;
  return out;
}

// Values nearest to a pivot on either side.
template <class T>
struct Sides {
  T below_most = -Wide<T>::infinity;                       // the largest one below the pivot
  T least = Wide<T>::infinity, most = -Wide<T>::infinity;  // least and largest of the others

  void add(T v, T pivot) {
    if (v < pivot) {
      below_most = std::max(below_most, v);
    } else {
      least = std::min(least, v);
      most = std::max(most, v);
    }
  }
};

// Sides of whole vectors of values.
template <class T>
WEFT_INLINE Sides<T> part_vectors(const T* values, std::size_t count, T pivot) {
  using W = Wide<T>;
  const auto at = W::all(pivot), low = W::all(-W::infinity), high = W::all(W::infinity);
  auto below_most = low, least = high, most = low;
  for (std::size_t i = 0; i < count; i += W::width) {
    const auto v = W::load(values + i), below = v < at ? v : low, from = v < at ? high : v,
               to = v < at ? low : v;
    below_most = below_most > below ? below_most : below;
    least = least < from ? least : from;
    most = most > to ? most : to;
  }
  Sides<T> out;
  for (std::size_t k = 0; k < W::width; ++k) {
    out.below_most = std::max(out.below_most, below_most[k]);
    out.least = std::min(out.least, least[k]);
    out.most = std::max(out.most, most[k]);
  }
  return out;
}
WEFT_CLONES("arch=x86-64-v4", "avx2")
Sides<double> part_whole(const double* values, std::size_t count, double pivot) {
  return part_vectors(values, count, pivot);
}
WEFT_CLONES("arch=x86-64-v4", "avx2")
Sides<float> part_whole(const float* values, std::size_t count, float pivot) {
  return part_vectors(values, count, pivot);
}

template <class T>
Sides<T> part(std::span<const T> values, T pivot) {
  const std::size_t whole = values.size() / Wide<T>::width * Wide<T>::width;
  Sides<T> out = part_whole(values.data(), whole, pivot);
  for (const T v : values.subspan(whole)) out.add(v, pivot);
  return out;
}

// Rounds values to nearest, which never changes their order; those too large for single precision
// become infinite.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void round_all(const double* values, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<float>(values[i]);
}

// True if any value of a whole round lies from `low` to `high`.
template <class T>
WEFT_INLINE bool has_within(const T* values, typename Wide<T>::Values low,
                            typename Wide<T>::Values high) {
  using W = Wide<T>;
  typename W::Integers within{};
  for (std::size_t c = 0; c < chains; ++c) {
    const auto v = W::load(values + c * W::width);
    within -= v >= low;
    within += v > high;
  }
  auto any = reinterpret_cast<Vectors<double>::Integers>(within);
  any |= __builtin_shufflevector(any, any, 4, 5, 6, 7, 0, 1, 2, 3);
  any |= __builtin_shufflevector(any, any, 2, 3, 0, 1, 6, 7, 4, 5);
  return (any[0] | any[1]) != 0;
}

// Copies `values` with `keys` from `low` to `high`. There are few, so a round without any is
// skipped at once.
template <class T>
WEFT_INLINE void pick_by(const T* keys, const double* values, std::size_t count, T low, T high,
                         std::vector<double>& out) {
  using W = Wide<T>;
  const auto least = W::all(low), most = W::all(high);
  const auto take = [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k)
      if (keys[k] >= low && keys[k] <= high) out.push_back(values[k]);
  };
  std::size_t i = 0;
  for (; i + W::round <= count; i += W::round)
    if (has_within(keys + i, least, most)) take(i, i + W::round);
  take(i, count);
}
WEFT_CLONES("arch=x86-64-v4", "avx2")
void pick(const double* keys, const double* values, std::size_t count, double low, double high,
          std::vector<double>& out) {
  pick_by(keys, values, count, low, high, out);
}
WEFT_CLONES("arch=x86-64-v4", "avx2")
void pick(const float* keys, const double* values, std::size_t count, float low, float high,
          std::vector<double>& out) {
  pick_by(keys, values, count, low, high, out);
}

// Bounds of a search: `before` values are below `low`. `up_to` values are below `high`, or not
// above it if it is one of the values.
template <class T>
struct Bounds {
  T low, high;
  std::size_t before = 0, up_to = 0;
  bool low_moved = false;

  [[nodiscard]] std::size_t within() const { return up_to - before; }

  // A pivot above low and at most high. It assumes evenly spread values. It lies a little beyond
  // the value sought, away from the bound that moved last, so that both bounds come near.
  [[nodiscard]] T pivot(std::size_t rank) const {
    const auto count = static_cast<double>(within());
    const double slack = 0.25 * std::sqrt(count);
    const double place = static_cast<double>(rank - before) + 1.0 + (low_moved ? slack : -slack);
    const double share = std::clamp(place / count, 0.05, 0.95);
    const auto at = static_cast<T>(static_cast<double>(low) * (1.0 - share) +
                                   static_cast<double>(high) * share);
    return at > low && at <= high ? at : high;
  }
};

// Bounds with few values between them that include the one of the rank, or bounds of values that
// are all equal to it.
template <class T>
Bounds<T> find_bounds(std::span<const T> values, std::size_t rank) {
  const Sides<T> all = part(values, -Wide<T>::infinity);
  Bounds<T> bounds{.low = all.least, .high = all.most, .up_to = values.size()};
  for (std::size_t round = 0; bounds.low < bounds.high && bounds.within() > few; ++round) {
    if (round == 3 * most_rounds) break;
    const T pivot = bounds.pivot(rank);
    const std::size_t below = count_below(values, pivot);
    bounds.low_moved = below <= rank;
    // Bounds that are values exclude at least one distinct value in each round.
    const bool by_value = round >= most_rounds;
    if (bounds.low_moved) {
      bounds.low = by_value ? part(values, pivot).least : pivot;
      bounds.before = below;
    } else {
      bounds.high = by_value ? part(values, pivot).below_most : pivot;
      bounds.up_to = below;
    }
  }
  return bounds;
}

// The least value larger than `v`; `v` if there is none.
double after(std::span<const double> values, double v) {
  const double least = part(values, std::nextafter(v, Wide<double>::infinity)).least;
  return std::isfinite(least) ? least : v;
}

}  // namespace

double sum_of(std::span<const double> values) {
  return add_up(values.data(), values.size());
}

double sum_of_squares(std::span<const double> values, double middle) {
  return add_squares(values.data(), values.size(), middle);
}

Level level_of(std::span<const double> values) {
  constexpr double epsilon = 0x1p-52, sum_tolerance = 1e-6;  // as for taxels
  const auto n = static_cast<double>(values.size());
  const double mean = sum_of(values) / n;
  const double deviation = std::sqrt(sum_of_squares(values, mean) / n);
  if (n * epsilon * (std::abs(mean) + deviation) <= sum_tolerance * deviation)
    return {mean, deviation};
  const auto rest_of = [&](double middle) {
    return add_deviations(values.data(), values.size(), middle) / n;
  };
  const double near = mean + rest_of(mean), rest = rest_of(near);
  const double variance = sum_of_squares(values, near) / n - rest * rest;
  return {near + rest, std::sqrt(std::max(variance, 0.0))};
}

std::size_t changes_of_sign(std::span<const double> values) {
  return values.empty() ? 0 : count_changes(values.data(), values.size() - 1);
}

void deviations(std::span<const double> values, double middle, double* out) {
  compute_deviations(values.data(), values.size(), middle, out);
}

MedianFinder::Pair MedianFinder::ranked(std::span<const double> values, std::size_t rank) {
  rounded_.resize(values.size());
  round_all(values.data(), values.size(), rounded_.data());
  const auto near = find_bounds(std::span<const float>(rounded_), rank);
  picked_.clear();
  std::size_t before = near.before;
  if (near.within() <= most_alike) {
    pick(rounded_.data(), values.data(), values.size(), near.low, near.high, picked_);
  } else {
    const auto bounds = find_bounds(values, rank);
    if (bounds.low == bounds.high)
      return {bounds.low, rank + 1 < bounds.up_to ? bounds.low : after(values, bounds.low)};
    pick(values.data(), values.data(), values.size(), bounds.low, bounds.high, picked_);
    before = bounds.before;
  }
  const auto at = picked_.begin() + static_cast<std::ptrdiff_t>(rank - before);
  std::nth_element(picked_.begin(), at, picked_.end());
  if (at + 1 != picked_.end()) return {*at, *std::min_element(at + 1, picked_.end())};
  return {*at, after(values, *at)};
}

double MedianFinder::median(std::span<const double> values) {
  if (values.empty()) return 0.0;
  const Pair pair = ranked(values, (values.size() - 1) / 2);
  return values.size() % 2 == 1 ? pair.at : 0.5 * pair.at + 0.5 * pair.next;
}

}  // namespace weft::classifier::vibro
