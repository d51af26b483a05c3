#pragma once
// One probability per class from the probabilities of all pairs (Wu, Lin and Weng 2004, second
// method).

#include <cstddef>
#include <span>
#include <vector>

namespace weft::classifier {

/// `first_wins` per pair in the order of all_pairs(classes): probability that it is the first of
/// the two, if it is one of the two; NaN is not allowed, values are clipped to [1e-7, 1 - 1e-7].
/// Returns p >= 0 of sum 1 that minimises sum over pairs of (r_ji p_i - r_ij p_j)^2: where the
/// pairs agree with each other (r_ij = p_i / (p_i + p_j)), exactly that p. Needs 2 classes or more.
std::vector<double> couple(std::span<const double> first_wins, std::size_t classes);

}  // namespace weft::classifier
