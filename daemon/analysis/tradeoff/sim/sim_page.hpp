#pragma once
// What is shown of `weft trade sim`: the page and the same as JSON; of the table from which a run
// chooses its level, a section.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/tradeoff/sim/downstream.hpp"
#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"
#include "daemon/pages/document/document.hpp"
#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon {

/// A section with a picture and the front as a table; `setting` ("L1 3.072 ms") is the campaign's,
/// and marked. Empty where the table has no setting.
/// Errors: what pareto_front() refuses.
Result<Blocks> fidelity_section(const sim::FidelityTable& table, std::string_view setting);

// The part of the page, of the data and of the text that is about trained classifiers.

/// A section with the tables.
Blocks downstream_section(const DownstreamResult& result);
nlohmann::ordered_json downstream_json(const DownstreamResult& result);

struct SimTradeoffReport {
  std::vector<SimSceneResult> scenes;
  std::optional<DownstreamResult> downstream;
  std::string command;   ///< as it was given
  std::string timing;    ///< how times were taken
  std::string machine;   ///< threads, system, compiler
  std::string load;      ///< of the machine at begin and end
  std::string software;  ///< version
  std::string commit;    ///< empty when unknown
};

Document sim_document(const SimTradeoffReport& report);

/// schema 1, keys in daemon/analysis/tradeoff/README.md.
nlohmann::ordered_json sim_tradeoff_json(const SimTradeoffReport& report);

}  // namespace weft::daemon
