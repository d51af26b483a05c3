#include "classifier/vibro/recording_probability.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "classifier/learners/class_folds.hpp"

namespace weft::classifier::vibro {
namespace {

// With fewer recordings the likeliest sharpness claims more than the data show. From this number on
// its lower bound would only make right predictions look unsure (README.md).
constexpr std::size_t few_recordings = 100;
constexpr std::size_t least_labels = 2;  // one label alone is always right

// Labels with whole recordings held out.
std::set<std::string> testable_labels(const FeatureMatrix& windows, Learner learner,
                                      const TrainOptions& options) {
  const FoldReport folds = fold_report(windows, learner, options);
  if (folds.none) return {};
  std::set<std::string> out(windows.labels.begin(), windows.labels.end());
  for (const auto& entry : folds.finer) out.erase(entry.first);
  for (const auto& entry : folds.untested) out.erase(entry.first);
  return out;
}

}  // namespace

std::vector<double> share_of_windows(std::span<const std::size_t> windows, double sharpness) {
  const auto labels = static_cast<double>(windows.size());
  double all = 1.0;
  for (const std::size_t count : windows) all += static_cast<double>(count);
  std::vector<double> out;
  for (const std::size_t count : windows)
    out.push_back((static_cast<double>(count) + 1.0 / labels) / all);
  sharpen(out, sharpness);
  return out;
}

std::string reason_without_probability(const FeatureMatrix& windows, Learner learner,
                                       const TrainOptions& options) {
  const std::size_t found = testable_labels(windows, learner, options).size();
  if (found >= least_labels) return {};
  return "too few labels with two recordings or groups: " + std::to_string(found) +
         " (expected at least " + std::to_string(least_labels) + ")";
}

Result<std::optional<VotePostprocessing>> calibrate_recordings(const TrainedLearner& learner,
                                                               const WindowSet& set,
                                                               const TrainOptions& options) {
  const FeatureMatrix& matrix = set.matrix;
  const std::set<std::string> testable = testable_labels(matrix, learner.kind(), options);
  if (testable.size() < least_labels) return std::optional<VotePostprocessing>{};
  const auto held = predict_held_out(learner, matrix, options);
  if (!held) return pass(held.error());
  if (!*held) return std::optional<VotePostprocessing>{};
  const HeldOut& rows = (*held)->rows;
  std::map<std::size_t, std::vector<std::size_t>> windows;  // recording -> windows per label
  std::map<std::size_t, std::size_t> truth;
  for (std::size_t i = 0; i < rows.row.size(); ++i) {
    const std::string& label = matrix.labels[rows.row[i]];
    if (!testable.contains(label)) continue;
    const std::size_t recording = set.recording[rows.row[i]];
    windows[recording].resize(learner.labels().size());
    ++windows[recording][rows.winner[i]];
    truth[recording] = find_place(learner.labels(), label);
  }
  std::vector<std::vector<double>> probability;
  std::vector<std::size_t> truths;
  for (const auto& [recording, own] : windows) {
    probability.push_back(share_of_windows(own));
    truths.push_back(truth[recording]);
  }
  VotePostprocessing out{{}, (*held)->calibration, {}};
  if (!truths.empty())
    out.calibration.sharpness = truths.size() < few_recordings
                                    ? cautious_sharpness(probability, truths)
                                    : fit_sharpness(probability, truths);
  return std::optional(std::move(out));
}

}  // namespace weft::classifier::vibro
