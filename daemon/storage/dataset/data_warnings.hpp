#pragma once
// Warnings about a data set that is valid but doubtful: signals that are constant, saturated, a
// clock, or too small for their level; names that look alike.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/features/signal_check.hpp"
#include "daemon/base/text/similar_names.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

void to_json(nlohmann::json& out, const Warning& warning);

/// One signal in all recordings, in their order.
struct CheckedSignal {
  std::string name;  ///< "7", "timestamp_ms"
  std::vector<classifier::SignalState> states;
  /// Resting value in each recording, if known. A limit counts as saturation only away from it,
  /// because an untouched taxel stays at its lowest value.
  std::vector<std::optional<double>> rest = {};
  double least_deviation = 0.0;  ///< below it features are at their floor
};

/// Warnings with the codes constant, saturated, only_rises, only_falls, few_digits and small_unit.
/// `signal` and `recording`: the nouns of the text ("taxel", "trial"). Signals with the same fault
/// in the same recordings share a sentence: "taxel 7 is constant in 3 of 40 trials (a.csv, b.csv,
/// c.csv)".
std::vector<Warning> describe_signals(std::span<const CheckedSignal> signals,
                                      std::span<const std::string> recordings,
                                      std::string_view signal, std::string_view recording);

/// find_similar_names() for the labels, then for the groups, of all trials or recordings.
template <class Recordings>
std::vector<Warning> find_similar_labels(const Recordings& recordings) {
  std::set<std::string> labels, groups;
  for (const auto& one : recordings) labels.insert(one.label), groups.insert(one.group);
  std::vector<Warning> out = find_similar_names(labels, "labels");
  for (Warning& of_group : find_similar_names(groups, "groups")) out.push_back(std::move(of_group));
  return out;
}

/// Warnings about the names, and about the motion of all complete trials (of one exploration, if
/// given).
std::vector<Warning> find_data_warnings(const Dataset& dataset, std::string_view exploration = {});

/// One line "WARNING: ..." each; for many warnings of one code, the first few and the number of the
/// others.
std::string warnings_text(std::span<const Warning> warnings);

}  // namespace weft::daemon
