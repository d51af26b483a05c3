#pragma once
// How many repetitions are enough; analyses of sweeps and studies of repetitions for people and
// programs: sections of a report, a page, JSON.

#include <algorithm>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "classifier/design/learning_curve.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "daemon/analysis/design/sweep_analysis.hpp"
#include "daemon/analysis/report/report.hpp"
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

// What a finished campaign says of campaigns to come, for its report.

/// So many repetitions make a learning curve of the report; fewer say too little.
inline constexpr std::size_t least_reported_repetitions = 6;

/// Of a sweep its analysis; of another campaign the learning curve of each exploration with enough
/// repetitions, foretold for twice as many. Nothing where neither is there, or where it cannot be
/// worked out: `progress` is then told why. Whole trials only: not for what a live vote has left.
/// `threads` (0: one per core) and `stop`, asked often, are of the learning curves.
DesignParts analyse_design(const Dataset& dataset,
                           const std::function<void(const std::string&)>& progress,
                           std::size_t threads = 0, const std::function<bool()>& stop = {});

// Analyses of sweeps and studies of repetitions for programs.

nlohmann::ordered_json design_json(const SweepAnalysis& analysis);
nlohmann::ordered_json design_json(const RepetitionStudy& study);

/// Whether a cell is on the Pareto front.
inline bool on_front(const SweepAnalysis& analysis, std::size_t cell) {
  return std::ranges::find(analysis.choice.front, cell) != analysis.choice.front.end();
}

/// Recommendation, heat maps of two factors at a time, Pareto front, table of all cells.
Blocks design_section(const SweepAnalysis& analysis);
/// Learning curve with its forecast.
Blocks design_section(const RepetitionStudy& study);

/// A page of such sections.
Document design_document(std::string_view title, BenchKind bench, Blocks sections);

}  // namespace weft::daemon
