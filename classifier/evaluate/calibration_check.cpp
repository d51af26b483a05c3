#include "classifier/evaluate/calibration_check.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "classifier/base/random.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t draws = 1000;

Status check_shares(std::span<const double> shares, const char* where) {
  for (const double p : shares)
    if (!(p >= 0.0 && p <= 1.0))
      return fail({.code = Errc::range,
                   .where = where,
                   .what = "probability out of range",
                   .expected = "0 to 1",
                   .got = std::to_string(p)});
  return {};
}

Status check_answers(std::span<const double> stated, std::span<const double> right,
                     std::size_t recordings, std::size_t bins) {
  constexpr const char* where = "calibration_error_interval";
  if (bins == 0 || stated.empty())
    return fail(
        {.code = Errc::invalid_argument,
         .where = where,
         .what = "no predictions or no bins to compare",
         .expected = "at least one prediction and one bin",
         .got = std::to_string(stated.size()) + " predictions, " + std::to_string(bins) + " bins"});
  if (right.size() != stated.size() || recordings != stated.size())
    return fail({.code = Errc::invalid_argument,
                 .where = where,
                 .what = "numbers of outcomes and recordings differ from the predictions",
                 .expected = std::to_string(stated.size()) + " of each",
                 .got = std::to_string(right.size()) + " and " + std::to_string(recordings)});
  if (auto ok = check_shares(stated, where); !ok) return ok;
  return check_shares(right, where);
}

// Contribution of one recording to each bin.
struct BinSums {
  std::vector<double> stated_minus_right;
  double answers = 0.0;
};

std::vector<BinSums> by_recording(std::span<const double> stated, std::span<const double> right,
                                  std::span<const std::string> recording, std::size_t bins) {
  std::map<std::string, BinSums> sums;
  for (std::size_t i = 0; i < stated.size(); ++i) {
    BinSums& one = sums[recording[i]];
    one.stated_minus_right.resize(bins);
    one.stated_minus_right[reliability_bin(stated[i], bins)] += stated[i] - right[i];
    one.answers += 1.0;
  }
  std::vector<BinSums> out;
  for (auto& entry : sums) out.push_back(std::move(entry.second));
  return out;
}

double error_of_draw(const std::vector<BinSums>& recordings, std::size_t bins,
                     RandomEngine& engine) {
  std::vector<double> sum(bins);
  double answers = 0.0;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const BinSums& one = recordings[engine() % recordings.size()];
    for (std::size_t b = 0; b < bins; ++b) sum[b] += one.stated_minus_right[b];
    answers += one.answers;
  }
  double error = 0.0;
  for (const double s : sum) error += std::abs(s) / answers;
  return error;
}

Status check_input(const Matrix& probability, std::span<const std::size_t> answer,
                   std::span<const std::size_t> truth, std::size_t bins) {
  if (bins == 0 || probability.rows() == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "reliability",
                 .what = "no trials or no bins to compare",
                 .expected = "at least one trial and one bin"});
  if (answer.size() != probability.rows() || truth.size() != probability.rows())
    return fail({.code = Errc::invalid_argument,
                 .where = "reliability",
                 .what = "numbers of predictions and true classes differ from the probabilities",
                 .expected = std::to_string(probability.rows()) + " of each",
                 .got = std::to_string(answer.size()) + " and " + std::to_string(truth.size())});
  for (const auto columns : {answer, truth})
    for (const std::size_t c : columns)
      if (c >= probability.cols())
        return fail({.code = Errc::range,
                     .where = "reliability",
                     .what = "class number out of range",
                     .expected = "< " + std::to_string(probability.cols()),
                     .got = std::to_string(c)});
  return check_shares(probability.data(), "reliability");
}

double squared_error(std::span<const double> p, std::size_t truth) {
  double sum = 0.0;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const double d = p[k] - (k == truth ? 1.0 : 0.0);
    sum += d * d;
  }
  return sum;
}

// Turns sums into means.
void finish(Reliability& out) {
  const auto n = static_cast<double>(out.trials);
  out.brier /= n;
  out.log_loss /= n;
  for (ReliabilityBin& bin : out.bins) {
    if (bin.count == 0) continue;
    out.calibration_error += std::abs(bin.predicted - bin.observed) / n;
    bin.predicted /= static_cast<double>(bin.count);
    bin.observed /= static_cast<double>(bin.count);
  }
}

}  // namespace

Status CalibrationTally::add(const FeatureMatrix& matrix, const Split& split,
                             const TrainedLearner& learner, const TrainOptions& options) {
  const auto postprocessing =
      fit_postprocessing(learner, select_rows(matrix, split.train), options);
  if (!postprocessing) return pass(postprocessing.error());
  if (!*postprocessing) return {};
  for (const std::size_t r : split.test) {
    const auto stated = predict(learner, *postprocessing, matrix.values.row(r));
    if (!stated) return pass(stated.error(), matrix.files[r]);
    std::vector<double> p(labels_.size());
    for (std::size_t k = 0; k < stated->probability.size(); ++k)
      p[find_place(labels_, learner.labels()[k])] = stated->probability[k];
    probability_.push_back(std::move(p));
    answer_.push_back(find_place(labels_, learner.labels()[stated->ballot.winner]));
    truth_.push_back(find_place(labels_, matrix.labels[r]));
    recording_.push_back(recording_of(matrix.files[r], r));
    split_.push_back(sizes_.size());
  }
  sizes_.push_back(size_of(split));
  return {};
}

std::vector<BinCheck> CalibrationTally::check_bins(std::span<const double> stated,
                                                   std::span<const double> right,
                                                   std::size_t bins) const {
  const SplitSizes sizes = mean_sizes(sizes_);
  std::vector<std::vector<SplitShare>> shares(bins, std::vector<SplitShare>(sizes_.size()));
  std::vector<std::set<std::string>> recordings(bins);
  for (std::size_t i = 0; i < stated.size(); ++i) {
    const std::size_t bin = reliability_bin(stated[i], bins);
    recordings[bin].insert(recording_[i]);
    shares[bin][split_[i]].part += right[i];
    shares[bin][split_[i]].whole += 1.0;
  }
  std::vector<BinCheck> out;
  for (std::size_t b = 0; b < bins; ++b)
    out.push_back({recordings[b].size(), split_interval(shares[b], sizes)});
  return out;
}

Result<CalibrationCheck> CalibrationTally::finish(std::size_t bins) const {
  Matrix probability(probability_.size(), labels_.size());
  std::vector<double> stated, right;
  for (std::size_t i = 0; i < probability_.size(); ++i) {
    std::copy(probability_[i].begin(), probability_[i].end(), probability.row(i).begin());
    stated.push_back(probability_[i][answer_[i]]);
    right.push_back(answer_[i] == truth_[i] ? 1.0 : 0.0);
  }
  auto figures = reliability(probability, answer_, truth_, bins);
  if (!figures) return pass(figures.error());
  auto interval = calibration_error_interval(stated, right, recording_, bins);
  if (!interval) return pass(interval.error());
  std::vector<std::string> distinct = recording_;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  return CalibrationCheck{std::move(*figures), check_bins(stated, right, bins), distinct.size(),
                          std::move(*interval)};
}

Result<Interval> calibration_error_interval(std::span<const double> stated,
                                            std::span<const double> right,
                                            std::span<const std::string> recording,
                                            std::size_t bins) {
  if (auto ok = check_answers(stated, right, recording.size(), bins); !ok) return pass(ok.error());
  Interval out{0.0, 1.0, "bootstrap of whole recordings, percentiles of 1000 draws"};
  const std::vector<BinSums> recordings = by_recording(stated, right, recording, bins);
  RandomEngine engine(1);
  std::vector<double> errors;
  for (std::size_t d = 0; d < draws; ++d) errors.push_back(error_of_draw(recordings, bins, engine));
  std::sort(errors.begin(), errors.end());
  out.low = errors[draws / 40];
  out.high = errors[draws - 1 - draws / 40];
  return out;
}

std::size_t reliability_bin(double stated, std::size_t bins) {
  return std::min(bins - 1, static_cast<std::size_t>(stated * static_cast<double>(bins)));
}

Result<Reliability> reliability(const Matrix& probability, std::span<const std::size_t> answer,
                                std::span<const std::size_t> truth, std::size_t bins) {
  if (auto ok = check_input(probability, answer, truth, bins); !ok) return pass(ok.error());
  Reliability out;
  out.trials = probability.rows();
  const auto width = static_cast<double>(bins);
  for (std::size_t b = 0; b < bins; ++b)
    out.bins.push_back(
        {static_cast<double>(b) / width, static_cast<double>(b + 1) / width, 0, 0, 0});
  for (std::size_t r = 0; r < out.trials; ++r) {
    const auto p = probability.row(r);
    const double stated = p[answer[r]];
    ReliabilityBin& bin = out.bins[reliability_bin(stated, bins)];
    ++bin.count;
    bin.predicted += stated;
    bin.observed += answer[r] == truth[r] ? 1.0 : 0.0;
    out.brier += squared_error(p, truth[r]);
    out.log_loss -= std::log(std::max(p[truth[r]], 1e-12));
  }
  finish(out);
  return out;
}

}  // namespace weft::classifier
