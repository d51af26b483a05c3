#pragma once
// Confidence intervals of an accuracy.

#include <cstddef>
#include <span>
#include <string>

namespace weft::classifier {

/// Normal quantile of 0.975.
inline constexpr double z95 = 1.959963984540054;

/// A 95 % interval and how it was computed, for the reader of a report.
struct Interval {
  double low = 0.0;
  double high = 1.0;
  std::string method;
};

/// Wilson's score interval of `correct` out of `total` independent trials (Wilson 1927); [0, 1]
/// without trials.
Interval wilson_interval(std::size_t correct, std::size_t total);
/// The same of a share (0 to 1) among so many trials, which need not be a whole number.
Interval wilson_of_share(double share, double total);

/// Of the mean accuracy of R >= 2 random splits of one data set into `train` and `test` trials, cut
/// to [0, 1]: mean +- t sd sqrt(1/R + test/train) with Student's t of R - 1 degrees of freedom. The
/// splits share trials, so sd / sqrt(R) would shrink to nothing with enough of them; test/train
/// stands for that correlation (Nadeau and Bengio 2003, Machine Learning 52, the corrected
/// resampled t). Splits that all agree have no sd to go by: Wilson's interval of a single one.
Interval split_interval(std::span<const double> accuracy, std::size_t train, std::size_t test);

/// The same of R >= 2 repetitions that share no trial, each with data of its own and `test` trials:
/// mean +- t sd / sqrt(R). Repetitions that all agree: Wilson's interval of a single one.
Interval repetition_interval(std::span<const double> accuracy, std::size_t test);

double mean_of(std::span<const double> values);
/// Sample standard deviation (n - 1); 0 for fewer than two values.
double deviation_of(std::span<const double> values);

}  // namespace weft::classifier
