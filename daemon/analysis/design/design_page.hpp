#pragma once
// Analyses of sweeps and studies of repetitions for people: sections of a report, or a page.

#include <string>
#include <string_view>

#include "daemon/analysis/design/repetition_study.hpp"
#include "daemon/analysis/design/sweep_analysis.hpp"

namespace weft::daemon {

/// Recommendation, heat maps of two factors at a time, Pareto front, table of all cells.
std::string design_section(const SweepAnalysis& analysis);
/// Learning curve with its forecast.
std::string design_section(const RepetitionStudy& study);

/// One file without scripts or outside resources around such sections.
std::string design_page(std::string_view title, BenchKind bench, std::string_view sections_html);

}  // namespace weft::daemon
