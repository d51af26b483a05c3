#pragma once
// Trains and tests pipelines on splits of windows.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/vibro/learn/pipeline.hpp"
#include "classifier/vibro/protocol.hpp"

namespace weft::classifier::vibro {

/// What came out over all splits.
struct CrossValidation {
  Confusion confusion;    ///< of windows, summed over the splits
  double accuracy = 0.0;  ///< of windows, mean over the splits
  double f_score = 0.0;   ///< macro, mean over the splits
  std::vector<double> split_accuracy{}, split_f_score{};
  /// Of test recordings (parts of one, with blocks) by the most frequent answer of their windows,
  /// the lowest of several.
  double voted_accuracy = 0.0;
  std::size_t voted = 0;          ///< different ones of them
  std::size_t voted_answers = 0;  ///< over all splits: each is asked in every split that tests it
  /// Over the splits, split_interval(); 0 to 1 with one alone, whose windows are not independent.
  Interval accuracy_ci95{}, f_score_ci95{};
  Interval voted_ci95{};         ///< of `voted_accuracy`: split_interval() of the splits' answers
  std::size_t components = 0;    ///< that were taken, the most of any split; 0: none
  double explained = 1.0;        ///< by the components, mean over the splits
  double train_s = 0.0;          ///< mean over the splits
  double answer_s = 0.0;         ///< one row at a time, scaling and components included: the median
  std::vector<Method> chosen{};  ///< per split, where the learner was chosen
};

/// Macro F-score: the mean of 2 TP / (2 TP + FP + FN) over the labels that were asked about or
/// answered, as scikit-learn takes it; 0 without any.
double f_score(const Confusion& confusion);

/// Refuses what Pipeline refuses, and no splits. Times are 0 without a clock.
Result<CrossValidation> cross_validate(const WindowSet& windows, std::span<const Split> splits,
                                       const PipelineOptions& options,
                                       const SecondsNow& seconds_now = {});

/// The training rows' own splits: each block or group of theirs left out in turn; with random
/// windows, every fifth row. Only those whose training rows have every label that `outer` trains;
/// there may be none.
std::vector<Split> inner_splits(const WindowSet& windows, const Split& outer, Protocol protocol);

/// Refuses a split of whose training windows inner_splits() makes nothing: what
/// cross_validate_chosen() would refuse, known before anything is trained.
Status check_choice(const WindowSet& windows, std::span<const Split> splits, Protocol protocol);

/// The same, but on every split the learner among `candidates` that answers best on parts of the
/// training windows left out in turn: blocks or groups of them, as `protocol` says. Nothing is
/// chosen by test windows. The first of equals. Candidates that are not available() are left out.
Result<CrossValidation> cross_validate_chosen(const WindowSet& windows,
                                              std::span<const Split> splits, Protocol protocol,
                                              std::span<const Method> candidates,
                                              const PipelineOptions& options,
                                              const SecondsNow& seconds_now = {});

}  // namespace weft::classifier::vibro
