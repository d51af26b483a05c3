#pragma once
// What `weft ... evaluate` measured, for people and for programs.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "classifier/vibro/extract.hpp"
#include "daemon/apps/weft/evaluate_outcome.hpp"

namespace weft::daemon::cli {

/// "silk (3 trials, in group g0 alone)", separated by commas; `recordings` is what they are called.
std::string format_never_tested(const std::vector<classifier::NeverTested>& labels,
                                std::string_view recordings);
/// [{label, recordings, group}]; group is null where it is not one alone.
nlohmann::json never_tested_json(const std::vector<classifier::NeverTested>& labels);

/// What is wrong with figures of test rows ("trials", "windows") that training has seen, where any
/// were.
std::string format_duplicates(const classifier::DuplicateRows& duplicates, std::string_view rows);
nlohmann::json duplicates_json(const classifier::DuplicateRows& duplicates);

/// The files of recordings into which no window fits.
nlohmann::json too_short_json(const std::vector<classifier::vibro::TooShort>& recordings);

/// How often the most frequent label is tested, and what a guess would give.
std::string format_balance(const classifier::Confusion& confusion);

/// What stands above every table: data, features, split, labels that it never tests, training.
std::vector<std::pair<std::string, std::string>> list_facts(const EvaluateArgs& args,
                                                            const ChosenTrials& chosen,
                                                            const Measured& measured);

/// Plain text, ends with a newline.
std::string report_text(const EvaluateArgs& args, const ChosenTrials& chosen,
                        const Measured& measured);

nlohmann::json report_json(const EvaluateArgs& args, const ChosenTrials& chosen,
                           const Measured& measured);

/// Counts of a confusion matrix: a row per true label, a column per answer, recall at the end.
/// Zeros are dots, so that mistakes stand out.
/// A label that no trial tested has no recall: "-".
std::string confusion_text(const classifier::Confusion& confusion);

}  // namespace weft::daemon::cli
