#pragma once
// One imprint of a tactile array as input of the classifier.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::imprint {

/// [rows x cols] taxel values in counts, row-major. The unit of length is the distance of two
/// taxels.
using Image = Matrix;

/// Larger than any reading, and small enough that no sum of squares overflows.
inline constexpr double largest_count = 1e100;
/// 4096 x 4096.
inline constexpr std::size_t most_taxels = std::size_t{1} << 24;

/// Refuses an image without taxels or with more than most_taxels. Refuses a value that is not
/// finite or beyond largest_count, with its row and column; so no computed feature becomes NaN.
Status check(const Image& image);

// Gaussian smoothing at any scale (Ellis 1986, section 3.3: a window of four standard deviations).
// The edge's value is replicated beyond the border (choice E1).

/// In taxels. The kernel then has 8001 weights; a larger scale is a mistake in a unit.
inline constexpr double largest_sigma = 1000.0;

/// Smooths images of any size at one scale. Keeps its scratch memory; one object per thread.
class GaussianFilter {
 public:
  /// `sigma` in taxels, 0 to largest_sigma; 0 does not change images. Refuses all other values.
  static Result<GaussianFilter> make(double sigma);

  /// `out` gets the size of `in`, a checked image; both must be different objects. Time grows with
  /// taxels x sigma, also for a sigma larger than the image. A constant image stays exactly
  /// constant, and a mirrored image gives the mirrored result to the last bit.
  void apply(const Image& in, Image& out);

  [[nodiscard]] double sigma() const { return sigma_; }
  /// Weights at distance 0, 1, ... ceil(4 sigma); the sum over both sides is 1.
  [[nodiscard]] std::span<const double> weights() const { return weights_; }

 private:
  GaussianFilter(double sigma, std::vector<double> weights)
      : sigma_(sigma), weights_(std::move(weights)) {}
  void smooth_columns(const Image& in);
  void smooth_rows(Image& out);

  double sigma_;
  std::vector<double> weights_;
  Image between_;
  std::vector<double> padded_;
};

}  // namespace weft::classifier::imprint
