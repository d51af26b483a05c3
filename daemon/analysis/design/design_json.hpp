#pragma once
// Analyses of sweeps and studies of repetitions for programs.

#include <nlohmann/json_fwd.hpp>

#include "daemon/analysis/design/repetition_study.hpp"
#include "daemon/analysis/design/sweep_analysis.hpp"

namespace weft::daemon {

nlohmann::ordered_json design_json(const SweepAnalysis& analysis);
nlohmann::ordered_json design_json(const RepetitionStudy& study);

}  // namespace weft::daemon
