#pragma once
// Analyses of sweeps and studies of repetitions for people: sections of a report, or a page.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "daemon/analysis/design/repetition_study.hpp"
#include "daemon/analysis/design/sweep_analysis.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// What a finished campaign says of campaigns to come, for its report.

/// So many repetitions make a learning curve of the report; fewer say too little.
inline constexpr std::size_t least_reported_repetitions = 6;

/// Of a sweep its analysis; of another campaign the learning curve of each exploration with enough
/// repetitions, foretold for twice as many. Nothing where neither is there, or where it cannot be
/// worked out: `progress` is then told why. Whole trials only: not for what a live vote has left.
DesignParts analyse_design(const Dataset& dataset,
                           const std::function<void(const std::string&)>& progress);

// Analyses of sweeps and studies of repetitions for programs.

nlohmann::ordered_json design_json(const SweepAnalysis& analysis);
nlohmann::ordered_json design_json(const RepetitionStudy& study);

/// Recommendation, heat maps of two factors at a time, Pareto front, table of all cells.
std::string design_section(const SweepAnalysis& analysis);
/// Learning curve with its forecast.
std::string design_section(const RepetitionStudy& study);

/// One file without scripts or outside resources around such sections.
std::string design_page(std::string_view title, BenchKind bench, std::string_view sections_html);

}  // namespace weft::daemon
