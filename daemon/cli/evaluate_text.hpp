#pragma once
// What `weft evaluate` measured, for people and for programs.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/cli/evaluate_outcome.hpp"

namespace weft::daemon::cli {

/// What stands above every table: data, features, split, training.
std::vector<std::pair<std::string, std::string>> facts_of(const EvaluateArgs& args,
                                                          const ChosenTrials& chosen,
                                                          const Measured& measured);

/// Plain text, ends with a newline.
std::string report_text(const EvaluateArgs& args, const ChosenTrials& chosen,
                        const Measured& measured);

nlohmann::json report_json(const EvaluateArgs& args, const ChosenTrials& chosen,
                           const Measured& measured);

}  // namespace weft::daemon::cli
