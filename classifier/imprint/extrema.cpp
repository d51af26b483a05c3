#include "classifier/imprint/extrema.hpp"

#include <cmath>

namespace weft::classifier::imprint {

void find_extrema(const Image& image, Extrema& out) {
  out.minima.clear();
  out.maxima.clear();
  for (std::size_t r = 1; r + 1 < image.rows(); ++r) {
    const double* const above = image.row(r - 1).data();
    const double* const here = image.row(r).data();
    const double* const below = image.row(r + 1).data();
    for (std::size_t c = 1; c + 1 < image.cols(); ++c) {
      const double ring[] = {above[c - 1], above[c],     above[c + 1], here[c - 1],
                             here[c + 1],  below[c - 1], below[c],     below[c + 1]};
      const double value = here[c];
      const bool low = value<ring[0], high = value> ring[0];
      if (!low && !high) continue;
      bool extreme = true;
      double sum = 0.0;
      for (const double near : ring) {
        extreme = extreme && (low ? value < near : value > near);
        sum += near;
      }
      if (extreme) (low ? out.minima : out.maxima).push_back(std::abs(value - sum / 8.0));
    }
  }
}

}  // namespace weft::classifier::imprint
