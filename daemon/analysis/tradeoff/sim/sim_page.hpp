#pragma once
// The results of `weft trade sim` as a page and as JSON. Also a section on the fidelity table, from
// which a run chooses its level.

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

/// A section with a picture, and the front as a table; the campaign's `setting` ("L1 3.072 ms") is
/// marked. Empty if the table has no setting. Errors: those of pareto_front().
Result<Blocks> fidelity_section(const sim::FidelityTable& table, std::string_view setting);

// The parts about trained classifiers.

/// A section with the tables.
Blocks downstream_section(const DownstreamResult& result);
nlohmann::ordered_json downstream_json(const DownstreamResult& result);

struct SimTradeoffReport {
  std::vector<SimSceneResult> scenes;
  std::optional<DownstreamResult> downstream;
  std::string command;   ///< as typed by the user
  std::string timing;    ///< how times were measured
  std::string machine;   ///< threads, system, compiler
  std::string load;      ///< of the machine at start and end
  std::string software;  ///< version
  std::string commit;    ///< empty if not known
};

Document sim_document(const SimTradeoffReport& report);

/// Schema 1; keys in docs/reference/reports.md.
nlohmann::ordered_json sim_tradeoff_json(const SimTradeoffReport& report);

}  // namespace weft::daemon
