#pragma once
// What the pads would have read at the samples of a run. They cost the same at every level from L1
// on and change nothing of the motion, so that they are read after it, all 16 at once and without
// noise and drift: what is compared is the plant.

#include "daemon/analysis/tradeoff/sim/sim_run.hpp"

namespace weft::daemon {

/// Fills `trace.pads` from its samples. Level L0 reads linear pads, others the cloth's law.
void read_pads(const SimCase& one, sim::Level level, SimTrace& trace);

}  // namespace weft::daemon
