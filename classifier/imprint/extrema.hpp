#pragma once
// Local minima and maxima of a smoothed imprint (Ellis 1986, section 3.3).

#include <vector>

#include "classifier/imprint/image.hpp"

namespace weft::classifier::imprint {

/// For every taxel below (above) all of its eight neighbours, how far below (above) their mean it
/// is, in counts, in row order. Strict, and interior taxels only (choice E4): a plateau has none.
struct Extrema {
  std::vector<double> minima, maxima;
};

/// `out` keeps its memory.
void find_extrema(const Image& image, Extrema& out);

}  // namespace weft::classifier::imprint
