#pragma once
// Confidence intervals of an accuracy.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace weft::classifier {

/// Normal quantile of 0.975.
inline constexpr double z95 = 1.959963984540054;

/// What precedes the floor in the name of a method whose interval it widened.
inline constexpr std::string_view widened_to = ", widened to ";

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

/// Training and test trials of a split, or their means over splits.
struct SplitSizes {
  double train = 0.0;
  double test = 0.0;
  bool whole_groups = false;  ///< each split tests a group that no other one tests
};
/// Means over at least one split.
SplitSizes mean_sizes(std::span<const SplitSizes> splits);

/// What one split says of a share: `part` of `whole` answers, which may be none.
struct SplitShare {
  double part = 0.0;
  double whole = 0.0;
};

/// Of the share sum(part) / sum(whole) over R splits of one data set, cut to [0, 1]. The same
/// trials are asked again in every split, so their answers are never counted as if they were
/// independent: drawing more splits does not narrow it to nothing.
/// `sizes` are means. R = 1: Wilson's. R >= 2: share +- t sd sqrt(1/R + test/train) with Student's
/// t of R - 1 degrees of freedom. sd / sqrt(R) would shrink to nothing with enough splits;
/// test/train stands for the trials that they share (Nadeau and Bengio 2003, Machine Learning 52,
/// the corrected resampled t). sd is of (part - share whole) / mean whole: of the splits' own
/// shares where they are of one size, else as of a ratio estimate (Cochran 1977, Sampling
/// Techniques, section 6.4). Splits that all agree have no sd to go by: Wilson's interval of the
/// mean whole of a split. Over whole groups, whose trials may all be right or wrong together, never
/// narrower than Wilson's of as many trials as there are groups: few errors tell no sd either
/// (docs/explanation/statistics.md has the coverage). The order of the splits does not matter.
/// Without answers 0 to 1.
Interval split_interval(std::span<const SplitShare> shares, const SplitSizes& sizes);

/// The same of the mean of a figure from 0 to 1, such as an accuracy: all splits weigh alike, and
/// where they agree Wilson's interval is of sizes.test answers.
Interval split_interval(std::span<const double> accuracy, const SplitSizes& sizes);

/// The same of R >= 2 repetitions that share no trial, each with data of its own and `test` trials:
/// mean +- t sd / sqrt(R). Repetitions that all agree: Wilson's interval of a single one.
Interval repetition_interval(std::span<const double> accuracy, std::size_t test);

double compute_mean(std::span<const double> values);
/// Sample standard deviation (n - 1); 0 for fewer than two values.
double compute_deviation(std::span<const double> values);

}  // namespace weft::classifier
