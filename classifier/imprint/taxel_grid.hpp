#pragma once
// The array that imprints are read from, as far as a model of imprints needs to know it.

#include <cstddef>
#include <string>

#include "classifier/imprint/imprint_set.hpp"

namespace weft::classifier::imprint {

/// An array, or the part of it that is scanned.
struct TaxelGrid {
  std::size_t rows = 0, cols = 0;
  double pitch_m = 0.0;        ///< from one taxel to the next; 0: not known
  std::size_t count_bits = 0;  ///< of a count; 0: not known
};

/// Imprints of both may be compared: as many rows and columns, and where both know it, a pitch that
/// is the same to 1 % (features are of scales in taxels) and as many bits.
bool is_same_grid(const TaxelGrid& a, const TaxelGrid& b);

/// "32 x 32 taxels, 0.281 mm apart, counts of 7 bits".
std::string format_grid(const TaxelGrid& grid);

/// Refuses an imprint of another size, and where the bits are known one with a count that they do
/// not hold.
Status check_imprint(const TaxelGrid& grid, const Imprint& imprint);

}  // namespace weft::classifier::imprint
