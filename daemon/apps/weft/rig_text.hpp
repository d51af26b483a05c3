#pragma once
// How a campaign or an alignment has left the bench, for the person who stands before it.

#include <string>

#include "recipes/engine/engine.hpp"

namespace weft::daemon::cli {

/// What is not as after a good end, and what to do; empty where the probe is up and nothing was
/// left out.
std::string format_rig(recipes::Cleanup cleanup, recipes::RigFact rig);

}  // namespace weft::daemon::cli
