#pragma once
// What was measured of one choice of settings and of all choices on one data set; which are worth
// considering; a page with a picture and a table per data set, and the same as JSON.

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

// Which choices are worth considering when more of one thing costs more of another.

/// What a choice brings (more is better) and what it costs (less is better).
struct TradeoffChoice {
  double gain = 0;
  double cost = 0;
};

/// The Pareto front: indices of all choices that no other one dominates, by rising cost (equal cost
/// means equal gain there; those in the order given). A choice dominates another when it gains at
/// least as much for at most the cost, and is better in one of the two. Choices equal in both do
/// not dominate each other, so all of them are on the front or none. Refuses a gain or cost that is
/// not finite, by its index. O(n log n).
Result<std::vector<std::size_t>> pareto_front(std::span<const TradeoffChoice> choices);

/// A number or a word, under its name.
using Setting = std::pair<std::string, std::variant<double, std::string>>;

struct TradeoffPoint {
  std::string name;    ///< short, for the picture: "N 5"
  std::string family;  ///< which setting differs from the default: "feature count"
  std::vector<Setting> settings;
  BenchKind bench = BenchKind::unknown;
  double accuracy = 0;  ///< share of right answers on trials that did not train
  classifier::Interval ci95;
  std::size_t tested = 0;         ///< test trials over all splits
  std::vector<double> timings_s;  ///< of an answer, one per timed trial: median of repetitions
  double answer_s = 0;            ///< mean of timings_s
  double features_s = 0;          ///< part of answer_s
  double vote_s = 0;
  double contact_s = 0;  ///< seconds of sliding that an answer needs, mean over the trials
  double train_s = 0;    ///< grid search included, mean over the splits
};

/// One direction of the picture: what accuracy is weighed against.
struct TradeoffCost {
  std::string key;    ///< in JSON: "answer_s"
  std::string title;  ///< with unit
  std::string words;  ///< for a table: "compute time"
  double TradeoffPoint::*seconds;
};

/// Everything measured on one data set. One front is never drawn over two of them.
struct TradeoffSet {
  std::string dataset;  ///< as it was named
  std::string sha256;
  BenchKind bench = BenchKind::unknown;
  std::vector<Setting> facts;                                 ///< trials, split, training ...
  std::vector<std::pair<std::string, std::string>> left_out;  ///< what, why
  std::vector<TradeoffPoint> points;                          ///< at least one
};

/// Indices of the points on the front of `cost`, by rising cost. Refuses no points, a figure that
/// is not finite, a time that is not positive, and a point of another bench than the set's.
Result<std::vector<std::size_t>> find_front(const TradeoffSet& set, const TradeoffCost& cost);

/// The families of all sets, in the order of their first points.
std::vector<std::string> list_families(std::span<const TradeoffSet> sets);

/// "20" or "pvalue".
std::string format_text(const Setting& setting);
/// The middle one, or the mean of the middle two; 0 without values.
double compute_median(std::vector<double> values);

struct TradeoffReport {
  std::string title;                 ///< "Classifier: accuracy against time"
  std::string command;               ///< "trade classifier"
  std::vector<TradeoffCost> costs;   ///< a panel and a front each
  std::vector<TradeoffSet> sets;     ///< a section each, in this order
  std::vector<std::string> notes;    ///< how to read it; for people
  std::string measure = "accuracy";  ///< what `accuracy` of the points is: "macro F-score"
  Blocks tables;         ///< further sections of the page; of simulated data with badges
  std::string timing;    ///< how times were taken
  std::string training;  ///< options of the training
  std::string machine;
  std::string software;  ///< version
  std::string commit;    ///< empty when unknown
};

/// schema 1, keys in daemon/analysis/tradeoff/README.md. Refuses what find_front() refuses.
Result<nlohmann::ordered_json> tradeoff_json(const TradeoffReport& report);

/// The sections of the sets and `tables`, for a page of another's. Refuses what find_front()
/// refuses.
Result<Blocks> tradeoff_sections(const TradeoffReport& report);

/// Refuses what find_front() refuses.
Result<Document> tradeoff_document(const TradeoffReport& report);

}  // namespace weft::daemon
