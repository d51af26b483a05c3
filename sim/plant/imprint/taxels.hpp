#pragma once
// What the array makes of pressures: 7 bits, a ceiling, and a cover that lets go late.
// Source: Ellis (1986), section 3.1.

#include <cstdint>
#include <vector>

#include "sim/plant/imprint/height_map.hpp"

namespace weft::sim {

struct TaxelParams {
  double full_scale_pa = 150e3;  ///< pressure of the highest count [E]
  int bits = 7;                  ///< "approximately 7 bits/taxel"
  double hysteresis = 0.25;      ///< reading that may linger above the pressure, of the pressure;
                                 ///< "one part in four" is what hysteresis leaves of the force
  double noise_counts = 0.4;     ///< rms [E]
};

/// Refuses a full scale outside 1 Pa to 1 GPa, other than 1 to 12 bits, hysteresis outside 0 to 4,
/// noise outside 0 to 100 counts.
Status check(const TaxelParams& params);

/// One frame.
struct TaxelFrame {
  std::size_t rows = 0;
  std::size_t cols = 0;
  std::vector<std::uint16_t> counts;  ///< rows x cols, 0 to 2^bits - 1
  double saturated_fraction = 0;
};

/// The cover's memory: what each taxel felt last [Pa]; empty before the first press.
struct CoverState {
  std::vector<double> felt_pa;
};

/// Follows a rise at once and a fall only when the pressure has fallen below felt/(1 + hysteresis):
/// a play operator, without rate, so that any path between the same extremes reads the same.
/// Errors: range, for parameters as in `check`, a pressure that is negative or not a number, or a
/// state of another size.
Result<TaxelFrame> read_taxels(const TaxelParams& params, const Imprint& imprint, CoverState& cover,
                               std::uint64_t noise_seed);

}  // namespace weft::sim
