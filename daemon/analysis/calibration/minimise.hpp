#pragma once
// Minimum within the unit cube, without derivatives: BOBYQA of NLopt (docs/adr/0023).

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon::calibration {

/// At least 0 and finite. Called from one thread.
using Cost = std::function<double(std::span<const double> at)>;

struct Minimum {
  std::vector<double> at;  ///< in [0, 1]
  double value = 0;
  std::size_t evaluations = 0;
};

/// True if Weft was built with NLopt.
bool has_nlopt();
/// "2.7.1"; empty without it.
std::string nlopt_version();

/// The best point of at most `evaluations` from `start`; the start itself if nothing is better.
/// Deterministic: stops by counts and step size, never by time. Errors: unsupported (Weft was built
/// without NLopt; the hint names what to install).
Result<Minimum> minimise(const Cost& cost, std::span<const double> start, std::size_t evaluations);

/// Point `index` of Sobol's sequence (Joe and Kuo 2008), starting at 1; at most 8 dimensions.
std::vector<double> sobol_point(std::size_t index, std::size_t dimensions);

/// Calls minimise() from `start` and from points 1 to `starts` - 1 of Sobol's sequence, with
/// `evaluations` for each, then again from the best. With more than 8 dimensions, from `start`
/// only. Errors: those of minimise().
Result<Minimum> minimise_from_many(const Cost& cost, std::span<const double> start,
                                   std::size_t starts, std::size_t evaluations);

}  // namespace weft::daemon::calibration
