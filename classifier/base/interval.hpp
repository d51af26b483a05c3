#pragma once
// Confidence intervals of an accuracy.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace weft::classifier {

/// Normal quantile of 0.975.
inline constexpr double z95 = 1.959963984540054;

/// Words before the floor in Interval::method when the floor widened the interval.
inline constexpr std::string_view widened_to = ", widened to ";

/// A 95 % interval and how it was computed, for the reader of a report.
struct Interval {
  double low = 0.0;
  double high = 1.0;
  std::string method;
};

/// Wilson's score interval of `correct` out of `total` independent trials (Wilson 1927). Without
/// trials [0, 1].
Interval wilson_interval(std::size_t correct, std::size_t total);
/// Wilson's interval of a share (0 to 1) among `total` trials; `total` need not be a whole number.
Interval wilson_of_share(double share, double total);

/// Training and test trials of a split, or their means over splits.
struct SplitSizes {
  double train = 0.0;
  double test = 0.0;
  bool whole_groups = false;  ///< each split tests a group that no other split tests
};
/// Means over the splits; needs at least one split.
SplitSizes mean_sizes(std::span<const SplitSizes> splits);

/// The share that one split measured: `part` of `whole` answers; `whole` may be 0.
struct SplitShare {
  double part = 0.0;
  double whole = 0.0;
};

/// Interval of the share sum(part) / sum(whole) over R splits of one data set, cut to [0, 1]. Every
/// split tests the same trials again, so their answers do not count as independent. Therefore more
/// splits do not narrow the interval to nothing.
/// `sizes` are means. R = 1: Wilson's interval. R >= 2: share +- t sd sqrt(1/R + test/train) with
/// Student's t of R - 1 degrees of freedom. sd / sqrt(R) would shrink to nothing with enough
/// splits; test/train accounts for the trials that the splits share (Nadeau and Bengio 2003,
/// Machine Learning 52, the corrected resampled t). sd is the deviation of (part - share whole) /
/// mean whole. For splits of equal size that is the deviation of their shares, else the deviation
/// of a ratio estimate (Cochran 1977, Sampling Techniques, section 6.4). Splits that all agree have
/// no sd; they get Wilson's interval of the mean `whole` of a split. With whole groups, all trials
/// of a group may be right or wrong together. That interval is never narrower than Wilson's of as
/// many trials as there are groups, because few errors give no reliable sd
/// (docs/explanation/statistics.md has the coverage). The order of the splits does not matter.
/// Without answers [0, 1].
Interval split_interval(std::span<const SplitShare> shares, const SplitSizes& sizes);

/// Interval of the mean of a figure from 0 to 1, such as an accuracy. All splits have equal weight.
/// Where they agree it is Wilson's interval of sizes.test answers.
Interval split_interval(std::span<const double> accuracy, const SplitSizes& sizes);

/// Interval over R >= 2 repetitions that share no trial, each with its own data and `test` trials:
/// mean +- t sd / sqrt(R). Repetitions that all agree get Wilson's interval of a single one.
Interval repetition_interval(std::span<const double> accuracy, std::size_t test);

double compute_mean(std::span<const double> values);
/// Sample standard deviation (n - 1); 0 for fewer than two values.
double compute_deviation(std::span<const double> values);

}  // namespace weft::classifier
