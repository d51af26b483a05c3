#pragma once
// The sections of report.html, each a piece of markup.

#include <string>

#include "daemon/analysis/report/report.hpp"

namespace weft::daemon {

/// "SIMULATED", "REAL BENCH" or "BENCH UNKNOWN"; and "INCOMPLETE, 12 of 680 trials" where that is
/// so.
std::string badge_html(const ReportInput& input);

/// Style of the paper: the campaign's name and its bench at the head of every page.
std::string paper_style(const ReportInput& input);
std::string heading_section(const ReportInput& input);  ///< title, honesty note, tiles
std::string trace_section(const ReportInput& input);
std::string accuracy_section(const ReportInput& input);
std::string core_section(const ReportInput& input);
std::string timing_section(const ReportInput& input);
std::string force_section(const ReportInput& input);
std::string certificate_section(const ReportInput& input);  ///< of a report made afterwards
std::string wall_time_section(const ReportInput& input);
std::string provenance_section(const ReportInput& input);

}  // namespace weft::daemon
