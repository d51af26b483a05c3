#pragma once
// Confidence intervals of an accuracy.

#include <cstddef>
#include <span>
#include <string>

namespace weft::classifier {

/// A 95 % interval and how it was computed, for the reader of a report.
struct Interval {
  double low = 0.0;
  double high = 1.0;
  std::string method;
};

/// Wilson's score interval of `correct` out of `total` independent trials (Wilson 1927); [0, 1]
/// without trials.
Interval wilson_interval(std::size_t correct, std::size_t total);

/// Mean +- 1.96 sd / sqrt(n) of the accuracies of n >= 2 random splits, cut to [0, 1]. It describes
/// the mean over splits of this data set; the splits share trials, so it says nothing about new
/// recordings.
Interval split_interval(std::span<const double> accuracy);

double mean_of(std::span<const double> values);
/// Sample standard deviation (n - 1); 0 for fewer than two values.
double deviation_of(std::span<const double> values);

}  // namespace weft::classifier
