#pragma once
// Measured results of one choice of settings and of all choices on one data set, and the choices
// worth considering. A page with a picture and a table per data set, and the same as JSON.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "classifier/base/interval.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// Selects the choices worth considering if one quantity improves at the cost of another.

/// Gain (more is better) and cost (less is better) of a choice.
struct TradeoffChoice {
  double gain = 0;
  double cost = 0;
};

/// The Pareto front: indices of all choices that no other one dominates, by rising cost. Choices of
/// equal cost on the front have equal gain and keep the given order. A choice dominates another if
/// it gains at least as much for at most the cost, and is better in one of the two. Choices equal
/// in both do not dominate each other: all of them are on the front or none. Refuses a gain or cost
/// that is not finite, by its index. O(n log n).
Result<std::vector<std::size_t>> pareto_front(std::span<const TradeoffChoice> choices);

/// A named number or text.
using Setting = std::pair<std::string, std::variant<double, std::string>>;

struct TradeoffPoint {
  std::string name;    ///< short, for the picture: "N 5"
  std::string family;  ///< setting that differs from the default: "feature count"
  std::vector<Setting> settings;
  BenchKind bench = BenchKind::unknown;
  double accuracy = 0;  ///< share of correct predictions on test trials
  classifier::Interval ci95;
  std::size_t tested = 0;         ///< test trials over all splits
  std::vector<double> timings_s;  ///< time of a prediction, one per timed trial: median of
                                  ///< repetitions
  double answer_s = 0;            ///< mean of timings_s
  double features_s = 0;          ///< part of answer_s
  double vote_s = 0;
  double contact_s = 0;  ///< duration of sliding per prediction, mean over the trials
  double train_s = 0;    ///< including the grid search, mean over the splits
};

/// One cost axis of the picture, against which accuracy is plotted.
struct TradeoffCost {
  std::string key;    ///< in JSON: "answer_s"
  std::string title;  ///< with unit
  std::string words;  ///< for a table: "compute time"
  double TradeoffPoint::*seconds;
};

/// All results on one data set. A front is never drawn over two data sets.
struct TradeoffSet {
  std::string dataset;  ///< name given by the user
  std::string sha256;
  BenchKind bench = BenchKind::unknown;
  std::vector<Setting> facts;                                 ///< trials, split, training ...
  std::vector<std::pair<std::string, std::string>> left_out;  ///< name, reason
  std::vector<TradeoffPoint> points;                          ///< not empty
};

/// Indices of the points on the front of `cost`, by rising cost. Refuses an empty set, a value that
/// is not finite, a time that is not positive, and a point of another bench than the set's.
Result<std::vector<std::size_t>> find_front(const TradeoffSet& set, const TradeoffCost& cost);

/// The families of all sets, in the order of their first points.
std::vector<std::string> list_families(std::span<const TradeoffSet> sets);

/// "20" or "pvalue".
std::string format_text(const Setting& setting);
/// The middle value, or the mean of the middle two; 0 without values.
double compute_median(std::vector<double> values);

struct TradeoffReport {
  std::string title;                 ///< "Classifier: accuracy against time"
  std::string command;               ///< "trade classifier"
  std::vector<TradeoffCost> costs;   ///< one panel and one front each
  std::vector<TradeoffSet> sets;     ///< one section each, in this order
  std::vector<std::string> notes;    ///< explanations for the reader
  std::string measure = "accuracy";  ///< meaning of `accuracy` in the points: "macro F-score"
  Blocks tables;                     ///< further sections of the page; simulated data with badges
  std::string timing;                ///< how times were measured
  std::string training;              ///< options of the training
  std::string machine;
  std::string software;  ///< version
  std::string commit;    ///< empty if not known
};

/// Schema 1; keys in docs/reference/reports.md. Refuses what find_front() refuses.
Result<nlohmann::ordered_json> tradeoff_json(const TradeoffReport& report);

/// The sections of the sets and `tables`, for use in another page. Refuses what find_front()
/// refuses.
Result<Blocks> tradeoff_sections(const TradeoffReport& report);

/// Refuses what find_front() refuses.
Result<Document> tradeoff_document(const TradeoffReport& report);

}  // namespace weft::daemon
