#pragma once
// Statistics of one signal. Every one is defined for every finite signal, constant and empty ones
// included.

#include <cstddef>
#include <span>
#include <vector>

namespace weft::classifier {

/// Moments about the mean; the signal is centred before it is raised to a power.
struct Moments {
  double mean = 0.0;
  double m2 = 0.0;  ///< biased: divided by n
  double m3 = 0.0;
  double m4 = 0.0;
  double m5 = 0.0;
  bool constant = true;  ///< no variation beyond rounding: m2 <= 1e-24 max(1, mean^2)
};

/// Two passes over `signal`. A constant signal gets exact zeros.
Moments moments_of(std::span<const double> signal);

/// Biased m3 / m2^1.5; 0 for fewer than 3 values or a constant signal.
double skewness_of(std::span<const double> signal);

/// Values of the strict local maxima into `out`: a flat top counts once, end points never (as
/// MATLAB's findpeaks).
void local_maxima(std::span<const double> signal, std::vector<double>& out);

/// Most frequent value on a grid of `bin`; the smallest of several (as MATLAB's mode).
double mode_of(std::span<const double> signal, double bin);

}  // namespace weft::classifier
