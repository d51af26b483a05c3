#include "sim/plant/fabric_law.hpp"

#include <cmath>

#include "sim/plant/bounds.hpp"

namespace weft::sim {

namespace {

constexpr double smallest_x = 1e-3;
constexpr double largest_x = 500;

/// LC of the exponential law, x = (compression at the peak pressure)/lambda. Decreases from 1 to 0.
double linearity_at(double x) {
  return 2 * (1 / x - 1 / std::expm1(x));
}

double solve_linearity(double linearity) {
  double low = smallest_x, high = largest_x;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (linearity_at(middle) > linearity ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

Result<FabricLaw> law_from_kes(const KesCompression& kes) {
  if (const Status s =
          check_limits({{"LC", "LC out of range", kes.linearity, linearity_at(largest_x),
                         linearity_at(smallest_x), "0.004 to 0.999"},
                        {"WC", "WC out of range", kes.work_j_m2, 1e-6, 1e3, "1e-6 to 1e3 J/m2"},
                        {"RC", "RC out of range", kes.resilience, 0.01, 1, "0.01 to 1"}});
      !s)
    return pass(s.error());
  const double x = solve_linearity(kes.linearity);
  const double compression_m = 2 * kes.work_j_m2 / (kes.linearity * kes_peak_pressure_pa);
  return FabricLaw{.lambda_m = compression_m / x,
                   .pressure_pa = kes_peak_pressure_pa / std::expm1(x),
                   .hysteresis = (1 - kes.resilience) / (1 + kes.resilience)};
}

void RelaxationStep::weigh(const Relaxation& relaxation, double dt_s) {
  for (std::size_t i = 0; i < Relaxation::terms; ++i) {
    const double x = dt_s / relaxation.time_s[i];
    const double decayed = -std::expm1(-x);
    const double average = x > 0 ? decayed / x : 1;  // mean of e^{-s} over the step
    decay[i] = 1 - decayed;
    at_end[i] = relaxation.share[i] * (1 - average);
    at_begin[i] = relaxation.share[i] * (average - decay[i]);
    gain -= at_end[i];
  }
}

FabricLaw compose(const FabricLaw& cloth, const Cover& cover) {
  if (!(cover.lambda_m > 0)) return cloth;
  FabricLaw both = cloth;
  both.lambda_m = cloth.lambda_m + cover.lambda_m;
  both.pressure_pa = std::exp((cloth.lambda_m * std::log(cloth.pressure_pa) +
                               cover.lambda_m * std::log(cover.pressure_pa)) /
                              both.lambda_m);
  return both;
}

}  // namespace weft::sim
