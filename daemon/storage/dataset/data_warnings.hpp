#pragma once
// What makes the figures of a data set doubtful and is no error: signals that are constant,
// saturated, a clock, or too small beside their level; names that look alike.

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

/// One signal of all recordings, in their order.
struct CheckedSignal {
  std::string name;  ///< "7", "timestamp_ms"
  std::vector<classifier::SignalState> states;
  /// Of each recording, where it is known: what a limit must differ from, as a taxel that is not
  /// touched stays at its lowest value.
  std::vector<std::optional<double>> rest = {};
  double least_deviation = 0.0;  ///< below it features are at their floor
};

/// Of the codes constant, saturated, only_rises, only_falls, few_digits and small_unit. `signal`
/// and `recording`: what one of them is called ("taxel", "trial"). Signals that are alike in the
/// same recordings share a sentence: "taxel 7 is constant in 3 of 40 trials (a.csv, b.csv, c.csv)".
std::vector<Warning> describe_signals(std::span<const CheckedSignal> signals,
                                      std::span<const std::string> recordings,
                                      std::string_view signal, std::string_view recording);

/// Of the labels, then of the groups, of all trials or recordings: find_similar_names().
template <class Recordings>
std::vector<Warning> find_similar_labels(const Recordings& recordings) {
  std::set<std::string> labels, groups;
  for (const auto& one : recordings) labels.insert(one.label), groups.insert(one.group);
  std::vector<Warning> out = find_similar_names(labels, "labels");
  for (Warning& of_group : find_similar_names(groups, "groups")) out.push_back(std::move(of_group));
  return out;
}

/// Of the names, and of the motion of all complete trials, of one exploration where it is given.
std::vector<Warning> find_data_warnings(const Dataset& dataset, std::string_view exploration = {});

/// A line "WARNING: ..." each; of many of one code the first few, and how many more there are.
std::string warnings_text(std::span<const Warning> warnings);

}  // namespace weft::daemon
