#pragma once
// From a core's decision value to the probability of its first class (Platt 2000, with the
// numerics of Lin, Lin and Weng 2007).

#include <span>

namespace weft::classifier {

/// p(f) = 1 / (1 + exp(slope f + offset)), slope <= 0: a larger f never makes class a less likely.
struct Sigmoid {
  double slope = 0.0;
  double offset = 0.0;

  /// In [0, 1]; never NaN, whatever finite f, slope and offset.
  [[nodiscard]] double operator()(double f) const;
};

/// Maximum likelihood on decision values that cross-validation held out, with Platt's targets
/// (n+ + 1) / (n+ + 2) and 1 / (n- + 2). Where decision values say the opposite of the signs, the
/// best sigmoid that does not fall is a constant. `f` finite; `sign` > 0 is class a.
Sigmoid fit_sigmoid(std::span<const double> f, std::span<const int> sign);

}  // namespace weft::classifier
