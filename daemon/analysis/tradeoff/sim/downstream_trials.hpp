#pragma once
// Trials of the paper's kind (rest, press, slide, rest) made of the plant at a given level, for
// asking what a classifier notices of the level. The same trials at every level: cloths, places,
// spreads and noise are drawn from the same seeds.

#include <cstdint>
#include <string>
#include <vector>

#include "classifier/features/trial.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::daemon {

/// How the trials' plant is computed.
struct DownstreamLevel {
  std::string name;  ///< "L2 0.192 ms"
  sim::Level level = sim::Level::quasistatic;
  double step_s = 0;  ///< from L2 on
};

/// What is made at each level.
struct DownstreamCampaign {
  std::size_t swatches = 2;  ///< of each cloth: different surfaces and waviness
  std::size_t trials = 8;    ///< on each swatch: spreads of the material, skew, noise
  double slide_s = 12.5;     ///< 25 mm at 2 mm/s
  std::size_t fabrics = 0;   ///< the first so many of the table; 0: all
};

/// The same trials seen by the 16 pads and by the force sensor (three channels, in steps of its
/// resolution, with half a step of noise). Groups are swatches: "1", "2".
struct DownstreamTrials {
  std::vector<classifier::Trial> pads, force;
};

/// `seed` names the rig and all draws. Errors: what cut_patch() refuses.
Result<DownstreamTrials> make_downstream_trials(const sim::FabricLibrary& library,
                                                const DownstreamCampaign& campaign,
                                                const DownstreamLevel& level, std::uint64_t seed);

}  // namespace weft::daemon
