#pragma once
// Minimum of a smooth convex function of many variables.

#include <cstddef>
#include <functional>
#include <vector>

namespace weft::classifier::vibro {

/// The value at `x`, and the slopes there in `slope` (as many as `x` has).
using Slopes = std::function<double(const std::vector<double>& x, std::vector<double>& slope)>;

struct MinimumOptions {
  double largest_slope = 1e-4;  ///< stop when no slope is larger
  std::size_t most_steps = 1000;
};

/// From `x` on, by L-BFGS with ten remembered steps (Nocedal 1980) and halved steps until the value
/// falls enough (Armijo). Returns where it stopped: at a slope small enough, after `most_steps`, or
/// where no step makes the value fall any more, which is as far as the arithmetic goes.
std::vector<double> minimum(const Slopes& function, std::vector<double> x,
                            const MinimumOptions& options = {});

}  // namespace weft::classifier::vibro
