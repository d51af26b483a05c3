#include "classifier/vibro/frame_features.hpp"

#include <cstdint>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {
namespace {

using simd::Lanes;
using Integers = std::int64_t __attribute__((vector_size(simd::width * sizeof(std::int64_t))));

// The sum of the lanes, each with its share of what is left behind the last whole group.
template <class Term>
WEFT_INLINE double folded(Lanes sum, const double* rest, std::size_t count, Term term) {
  double out = 0.0;
  for (std::size_t k = 0; k < simd::width; ++k) out += k < count ? sum[k] + term(rest[k]) : sum[k];
  return out;
}

// Groups of eight have so many sums in turn, so that none waits for the one before.
constexpr std::size_t chains = 4, round_size = chains * simd::width;

// The sum of `term` over all values, of which each is a value or eight.
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
double add_squares(const double* values, std::size_t count, double middle) {
  return sum_over(
      values, count, [=](auto v) __attribute__((always_inline)) {
        const auto away = v - simd::all<decltype(v)>(middle);
        return away * away;
      });
}

// Of the pairs (values[i], values[i + 1]), i < count.
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

}  // namespace

double sum_of(std::span<const double> values) {
  return add_up(values.data(), values.size());
}

double sum_of_squares(std::span<const double> values, double middle) {
  return add_squares(values.data(), values.size(), middle);
}

std::size_t changes_of_sign(std::span<const double> values) {
  return values.empty() ? 0 : count_changes(values.data(), values.size() - 1);
}

void deviations(std::span<const double> values, double middle, double* out) {
  compute_deviations(values.data(), values.size(), middle, out);
}

}  // namespace weft::classifier::vibro
