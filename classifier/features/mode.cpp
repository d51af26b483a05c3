#include "classifier/features/taxel_block.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

constexpr double widest_table = 65536.0;  // raw counts have 16 bits
constexpr std::size_t signals = ModeFinder::signals;

// Position of each signal's counts in the table.
struct Plan {
  ModeFinder::Values low{};   // smallest value, in bins
  ModeFinder::Values last{};  // number of the last bin; 0 if the signal is sorted instead
  std::array<std::size_t, signals> begin{};
  std::array<bool, signals> counted{};
  std::size_t size = 0;
};

Plan plan_tables(const ModeFinder::Values& low, const ModeFinder::Values& high, double bin) {
  Plan out;
  for (std::size_t k = 0; k < signals; ++k) {
    out.low[k] = std::nearbyint(low[k] / bin);
    const double last = std::nearbyint(high[k] / bin) - out.low[k];
    out.counted[k] = last < widest_table;
    out.last[k] = out.counted[k] ? last : 0.0;
    out.begin[k] = out.size;
    out.size += static_cast<std::size_t>(out.last[k]) + 1;
  }
  return out;
}

// Bin numbers of one sample of the first `width` signals, counted from the smallest value.
template <std::size_t width>
WEFT_INLINE void number_bins(const double* row, const Plan& plan, double bin, std::int32_t* out) {
  for (std::size_t k = 0; k < width; ++k) {
    const double v = std::nearbyint(row[k] / bin) - plan.low[k];
    out[k] = static_cast<std::int32_t>(v < plan.last[k] ? v : plan.last[k]);
  }
}

template <std::size_t width>
WEFT_INLINE void count_bins(const double* rows, std::size_t count, const Plan& where, double bin,
                            std::uint32_t* table) {
  const Plan plan = where;
  alignas(64) std::array<std::int32_t, width> at{};
  for (std::size_t i = 0; i < count; ++i, rows += width) {
    if (bin == 1.0) {
      number_bins<width>(rows, plan, 1.0, at.data());  // without the division
    } else {
      number_bins<width>(rows, plan, bin, at.data());
    }
    for (std::size_t k = 0; k < width; ++k)
      ++table[plan.begin[k] + static_cast<std::size_t>(at[k])];
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void count_sixteen(const double* rows, std::size_t count, const Plan& where, double bin,
                   std::uint32_t* table) {
  count_bins<signals>(rows, count, where, bin, table);
}

// Most frequent bin of up to `few` samples [count x signals of V]; the smallest of equally frequent
// ones.
constexpr std::size_t few = 16;
template <class V>
WEFT_INLINE void compare_all(const double* rows, std::size_t count, double bin, double* out) {
  constexpr std::size_t width = 2 * simd::lanes_of<V>;
  alignas(64) std::array<double, few * width> bins;
  if (bin == 1.0) {
    for (std::size_t i = 0; i < count * width; ++i) bins[i] = std::nearbyint(rows[i]);
  } else {
    for (std::size_t i = 0; i < count * width; ++i) bins[i] = std::nearbyint(rows[i] / bin);
  }
  for (std::size_t k = 0; k < width; k += simd::lanes_of<V>) {
    V best = simd::load<V>(&bins[k]), most = simd::all<V>(0.0);
    for (std::size_t i = k; count > 1 && i < count * width; i += width) {
      const V v = simd::load<V>(&bins[i]);
      V times = simd::all<V>(0.0);
      for (std::size_t j = k; j < count * width; j += width)
        times += simd::load<V>(&bins[j]) == v ? simd::all<V>(1.0) : simd::all<V>(0.0);
      const V of_equals = times == most ? simd::smaller(v, best) : best;
      best = times > most ? v : of_equals;
      most = simd::larger(times, most);
    }
    simd::store(out + k, bin * (best + simd::all<V>(0.0)));  // no -0
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void compare_sixteen(const double* rows, std::size_t count, double bin, double* out) {
  compare_all<simd::Lanes>(rows, count, bin, out);
}

// Index of the first of the highest counts.
WEFT_CLONES("arch=x86-64-v4", "avx2")
std::size_t highest(const std::uint32_t* counts, std::size_t size) {
  std::uint32_t most = 0;
  for (std::size_t i = 0; i < size; ++i) most = std::max(most, counts[i]);
  return static_cast<std::size_t>(std::find(counts, counts + size, most) - counts);
}

}  // namespace

double ModeFinder::by_sorting(const double* column, std::size_t width, std::size_t count,
                              double bin) {
  sorted_.resize(count);
  for (std::size_t i = 0; i < count; ++i) sorted_[i] = std::nearbyint(column[i * width] / bin);
  std::sort(sorted_.begin(), sorted_.end());
  double best = sorted_.front();
  std::size_t most = 0;
  for (std::size_t i = 0, j = 0; i < count; i = j) {
    while (j < count && sorted_[j] == sorted_[i]) ++j;
    if (j - i <= most) continue;
    most = j - i;
    best = sorted_[i];
  }
  return bin * best;
}

ModeFinder::Values ModeFinder::find(const double* rows, std::size_t width, std::size_t count,
                                    const Values& low, const Values& high, double bin) {
  Values out{};
  if (count <= few) {
    width == signals ? compare_sixteen(rows, count, bin, out.data())
                     : compare_all<double>(rows, count, bin, out.data());
    return out;
  }
  const Plan plan = plan_tables(low, high, bin);
  table_.assign(plan.size, 0);
  if (width == signals) {
    count_sixteen(rows, count, plan, bin, table_.data());
  } else {
    count_bins<2>(rows, count, plan, bin, table_.data());
  }
  for (std::size_t k = 0; k < width; ++k) {
    const std::size_t size = static_cast<std::size_t>(plan.last[k]) + 1;
    const std::size_t best = highest(table_.data() + plan.begin[k], size);
    out[k] = plan.counted[k] ? bin * (plan.low[k] + static_cast<double>(best))
                             : by_sorting(rows + k, width, count, bin);
  }
  return out;
}

}  // namespace weft::classifier
