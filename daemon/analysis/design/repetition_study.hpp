#pragma once
// How many repetitions are enough: the learning curve of a campaign and what it foretells.

#include <string>

#include "classifier/design/learning_curve.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

struct RepetitionStudy {
  BenchKind bench = BenchKind::unknown;
  std::string dataset;      ///< its digest
  std::string exploration;  ///< may be empty
  std::string learner;
  classifier::design::LearningCurve curve;
  classifier::design::RepetitionForecast forecast;
};

/// What makes the repetitions.
struct RepetitionChoice {
  /// Every trial of a fabric is a repetition of its own, numbered in an order drawn from the seed:
  /// for sets whose groups are not repetitions.
  bool strokes = false;
  std::size_t first = 0;  ///< only so many of them; 0: all
  std::uint64_t seed = 1;
};

/// The rows of these repetitions, with their number as the group; where a row's number is not on
/// record, or `matrix` was made of trials of another set, the groups are the repetitions, by name:
/// of all rows, for numbers and names of one set may mean the same repetition. A repetition that
/// lacks a fabric is left out as a whole: in each trial of a curve all fabrics are in question.
classifier::FeatureMatrix by_repetition(const classifier::FeatureMatrix& matrix,
                                        const Dataset& dataset, const RepetitionChoice& choice);

/// "20 repetitions give 93.1 % (88 to 97 %) ...", and how many are enough, in sentences.
std::string format_repetition_study(const RepetitionStudy& study);

}  // namespace weft::daemon
