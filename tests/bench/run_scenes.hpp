#pragma once
// Whole runs of one short trial on denim, each with something taken away from or put into a common
// scene: the simulated bench17 at level L1, cloth under a rigid cover, no wear.

#include <string>
#include <vector>

namespace weft::bench {

/// All begin with "run-".
std::vector<std::string> run_scene_names();
/// Runs a scene in a folder of its own, without the error check, whose replays are finer than the
/// scene. Ends the program with a sentence where the run is not complete, or the name unknown.
void run_scene(const std::string& name);

}  // namespace weft::bench
