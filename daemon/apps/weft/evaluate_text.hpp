#pragma once
// Results of `weft ... evaluate`, for people and for programs.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "classifier/vibro/extract.hpp"
#include "daemon/apps/weft/evaluate_outcome.hpp"

namespace weft::daemon::cli {

/// "silk (3 trials, in group g0 alone)", separated by commas; `recordings` is the word for trials.
std::string format_never_tested(const std::vector<classifier::NeverTested>& labels,
                                std::string_view recordings);
/// [{label, recordings, group}]; group is null unless it is a single one.
nlohmann::json never_tested_json(const std::vector<classifier::NeverTested>& labels);

/// Warning about test rows ("trials", "windows") that training has seen; empty if there are none.
std::string format_duplicates(const classifier::DuplicateRows& duplicates, std::string_view rows);
nlohmann::json duplicates_json(const classifier::DuplicateRows& duplicates);

/// The files of recordings that are shorter than a window.
nlohmann::json too_short_json(const std::vector<classifier::vibro::TooShort>& recordings);

/// Share of the most frequent label in the tests, and the accuracy of guessing.
std::string format_balance(const classifier::Confusion& confusion);

/// Facts above every table: data, features, split, labels that it never tests, training.
std::vector<std::pair<std::string, std::string>> list_facts(const EvaluateArgs& args,
                                                            const ChosenTrials& chosen,
                                                            const Measured& measured);

/// Plain text, ends with a newline.
std::string report_text(const EvaluateArgs& args, const ChosenTrials& chosen,
                        const Measured& measured);

nlohmann::json report_json(const EvaluateArgs& args, const ChosenTrials& chosen,
                           const Measured& measured);

/// Counts of a confusion matrix: a row per true label, a column per prediction, recall at the end.
/// Zeros are dots, so that mistakes are easy to see. A label without tested trials has no recall:
/// "-".
std::string confusion_text(const classifier::Confusion& confusion);

}  // namespace weft::daemon::cli
