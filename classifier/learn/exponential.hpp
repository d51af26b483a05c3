#pragma once
// exp(-x) of many values at once, the bulk of a radial basis kernel.

#include <span>

namespace weft::classifier {

/// value -> exp(-factor value) for factor >= 0 and values >= 0, in place. Within 2 units in the
/// last place of the true result; 0 where that is below 2^-1021. NaN stays NaN. The same on every
/// processor and compiler.
void exp_of_negative(std::span<double> values, double factor);

}  // namespace weft::classifier
