#pragma once
// Whole runs of one short trial on denim. Each adds something to a common scene or removes it: the
// simulated bench17 at level L1, fabric under a rigid cover, no wear.

#include <string>
#include <vector>

namespace weft::bench {

/// All names begin with "run-".
std::vector<std::string> run_scene_names();
/// Runs a scene in its own folder, without the error check, because its replays are finer than the
/// scene. Ends the program with a message if the run is not complete or the name is unknown.
void run_scene(const std::string& name);

}  // namespace weft::bench
