#pragma once
// `--accuracy` and `--budget`, of the commands that simulate a campaign or look at one.

#include <string>

#include "daemon/campaign/simulation.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct FidelityArgs {
  std::string accuracy, budget;  ///< as typed; empty: not asked for
};
/// A text that cannot be read is refused with the command line.
void add_options(CLI::App& command, FidelityArgs& args);

FidelityRequest fidelity_request(const FidelityArgs& args);

}  // namespace weft::daemon::cli
