#pragma once
// Analyses of sweeps and studies of the number of repetitions, for people and programs: sections of
// a report, a page, JSON.

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
  std::string dataset;      ///< digest of the data set
  std::string exploration;  ///< may be empty
  std::string learner;
  classifier::design::LearningCurve curve;
  classifier::design::RepetitionForecast forecast;
};

/// Definition of a repetition.
struct RepetitionChoice {
  /// Every trial of a fabric is its own repetition, numbered in random order by the seed. For sets
  /// in which groups are not repetitions.
  bool strokes = false;
  std::size_t first = 0;  ///< use only this number of repetitions; 0: all
  std::uint64_t seed = 1;
};

/// The rows of the chosen repetitions, with the repetition number as group. If any row's number is
/// not on record, or `matrix` comes from another set, the existing groups are the repetitions of
/// all rows. Numbers and names are not mixed, because both may mean the same repetition. A
/// repetition that lacks a fabric is left out: each split of a curve tests all fabrics.
classifier::FeatureMatrix by_repetition(const classifier::FeatureMatrix& matrix,
                                        const Dataset& dataset, const RepetitionChoice& choice);

/// "20 repetitions give 93.1 % (88 to 97 %) ...", and how many are sufficient, in sentences.
std::string format_repetition_study(const RepetitionStudy& study);

// Conclusions from a finished campaign for later campaigns, shown in its report.

/// Fewest repetitions for a learning curve in the report.
inline constexpr std::size_t least_reported_repetitions = 6;

/// The analysis of a sweep. For another campaign, the learning curve of each exploration with
/// enough repetitions, with a forecast for twice as many. Empty if there is neither or it fails;
/// `progress` then gets the reason. Uses whole trials only, not those left by a live vote.
/// `threads` (0: one per core) and `stop`, called often, apply to the learning curves.
DesignParts analyse_design(const Dataset& dataset,
                           const std::function<void(const std::string&)>& progress,
                           std::size_t threads = 0, const std::function<bool()>& stop = {});

// JSON of sweep analyses and repetition studies.

nlohmann::ordered_json design_json(const SweepAnalysis& analysis);
nlohmann::ordered_json design_json(const RepetitionStudy& study);

/// True if a cell is on the Pareto front.
inline bool on_front(const SweepAnalysis& analysis, std::size_t cell) {
  return std::ranges::find(analysis.choice.front, cell) != analysis.choice.front.end();
}

/// Recommendation, heat maps of two factors each, Pareto front, table of all cells.
Blocks design_section(const SweepAnalysis& analysis);
/// Learning curve with its forecast.
Blocks design_section(const RepetitionStudy& study);

/// A page made of such sections.
Document design_document(std::string_view title, BenchKind bench, Blocks sections);

}  // namespace weft::daemon
