#pragma once
// How a campaign was simulated, in words: for the terminal, the page and report.json.

#include <string>
#include <vector>

#include "daemon/campaign/simulation.hpp"

namespace weft::daemon {

/// "Simulated at level L1 3.072 ms because the scene needs a wrench and taxel counts; error against
/// L2 midpoint 0.2 ms: max 12.1 mN, rms 3.0 mN": the last of the errors, which knows most. Empty
/// on a bench that is not simulated.
std::string sentence(const SimulationNote& note);
/// One line for each error.
std::vector<std::string> error_lines(const SimulationNote& note);
/// Both for a terminal: at most 80 columns, each line ends with a newline.
std::string simulation_text(const SimulationNote& note);

}  // namespace weft::daemon
