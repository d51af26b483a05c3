#pragma once
// Gradient of a smoothed imprint, and the noise that its third differences tell of.

#include <span>

#include "classifier/imprint/image.hpp"

namespace weft::classifier::imprint {

/// Central differences in counts per taxel, the edge's value replicated: x to the right along a
/// row, y downwards, and their length.
struct Gradient {
  Image x, y, strength;
};

/// `out` takes the size of `image`.
void gradient(const Image& image, Gradient& out);

/// How the third differences become a noise (choice E2).
enum class NoiseForm {
  /// Converted to the deviation that white noise with these third differences, smoothed as the
  /// image was, has in a component of the gradient: counts per taxel.
  gradient,
  /// The paper's words: the root of the mean square itself, counts per taxel^3.
  literal
};

/// From the third differences (1, -3, 3, -1) along rows and columns of `smoothed`; `weights` are
/// those of the GaussianFilter that smoothed it. Lines shorter than four taxels have none; 0 where
/// there is none at all.
double noise_estimate(const Image& smoothed, std::span<const double> weights, NoiseForm form);

}  // namespace weft::classifier::imprint
