#pragma once
// What is shown of a trade: a page with a picture and a table per data set, and the same as JSON.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/tradeoff_point.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct TradeoffReport {
  std::string title;                ///< "Classifier: accuracy against time"
  std::string command;              ///< "trade classifier"
  std::vector<TradeoffCost> costs;  ///< a panel and a front each
  std::vector<TradeoffSet> sets;    ///< a section each, in this order
  std::vector<std::string> notes;   ///< how to read it; for people
  std::string tables_html;          ///< further sections of the page; of simulated data with badges
  std::string timing;               ///< how times were taken
  std::string training;             ///< options of the training
  std::string machine;
  std::string software;  ///< version
  std::string commit;    ///< empty when unknown
};

/// schema 1, keys in daemon/analysis/tradeoff/README.md. Refuses what find_front() refuses.
Result<nlohmann::ordered_json> tradeoff_json(const TradeoffReport& report);

/// The sections of the sets and `tables_html`, for a page of another's. Refuses what find_front()
/// refuses.
Result<std::string> tradeoff_sections_html(const TradeoffReport& report);

/// One file without scripts or outside resources. Refuses what find_front() refuses.
Result<std::string> tradeoff_html(const TradeoffReport& report);

}  // namespace weft::daemon
