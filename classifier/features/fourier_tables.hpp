#pragma once
// Tables of the transforms of fourier.hpp.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::fourier {

/// Twiddles of the first level by `radix`, then of the levels by four of a part, largest first: the
/// `w` of fourier.hpp. `part` is a power of two; a radix of 1 has no first level.
simd::AlignedDoubles twiddles(std::size_t radix, std::size_t part);

/// [radix x 2]: cos and sin of 2 pi k / radix, zeros exact.
std::vector<double> roots_of_unity(std::size_t radix);

/// Where forward() leaves each bin of a transform of `size`, a power of two.
std::vector<std::uint32_t> places(std::size_t size);

}  // namespace weft::classifier::fourier
