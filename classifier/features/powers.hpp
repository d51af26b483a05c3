#pragma once
// Sums of powers of deviations from the mean, of the signals of a TaxelBlock side by side.

#include <cstddef>

#include "classifier/base/lanes.hpp"
#include "classifier/features/taxel_block.hpp"

namespace weft::classifier {

inline constexpr double fewest_peaks = 3.0;  ///< least number for a skewness

/// 1 if the value before was a strict local maximum: the signal rose before and falls now. A flat
/// top counts once, end points never (as MATLAB's findpeaks). Updates `rising`, 1 or 0.
template <class V>
WEFT_INLINE V is_peak(V value, V last, V& rising) {
  const V peak = value < last ? rising : simd::all<V>(0.0);
  rising = value > last ? simd::all<V>(1.0) : rising - peak;
  return peak;
}

/// Sums of powers of deviations: of the signal about its mean, and of its peaks about theirs.
struct Powers {
  alignas(64) TaxelBlock::PerTaxel mean{}, second{}, third{}, fourth{}, fifth{};
  alignas(64) TaxelBlock::PerTaxel peak_mean{}, peak_second{}, peak_third{};
};

/// The largest magnitude of signal `k`.
double largest_value(const TaxelBlock::Running& running, std::size_t k);

/// Recomputes mean and powers of a signal in two passes if the sum of its mean may be off by more
/// than 1e-6 of the deviation. Sums of counts are exact; those of large or of many other values are
/// not. Powers of other signals keep their bits. `rows` [samples x width].
void refine_where_needed(const double* rows, std::size_t width, std::size_t samples,
                         const TaxelBlock::Running& running, Powers& out);

}  // namespace weft::classifier
