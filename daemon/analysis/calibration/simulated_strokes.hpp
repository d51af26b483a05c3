#pragma once
// Recorded strokes and the same strokes SIMULATED, as data sets and in statistics: what a
// calibrated table is worth is looked at with them, by whatever reads data sets.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/analysis/calibration/statistics.hpp"
#include "sim/plant/fabric.hpp"

namespace weft::daemon::calibration {

/// The table with each label's own cloth (name_in_table()) under the label alone and before the
/// others: so ClothModel takes it. A label without one gets what ClothModel finds.
sim::FabricLibrary with_own_cloths(sim::FabricLibrary library, const RecordingView& view,
                                   const std::string& prefix);

/// The trials of `recorded` that are complete, each with the counts of its stroke: above the
/// unloaded level, whole numbers, all of them phase M, the channels of the view alone, times by the
/// nominal rate. No other streams. `view`: make_recording_view() of `recorded` alone, or what
/// Scene::simulate() made like it.
Dataset stroke_dataset(const Dataset& recorded, const RecordingView& view, BenchKind kind);

/// Both in one, so that one side trains and the other tests: groups "recorded-G" and "simulated-G"
/// where the trials had G, files likewise, mountings of the second numbered on. Bench: unknown.
Dataset both_sides(Dataset recorded, Dataset simulated);

struct SidedStatistic {
  Statistic recorded;
  std::string strokes_of;  ///< of this cloth alone; empty: of all
  /// 95 % interval of the recorded one on its scale; none where it is of one cloth's strokes.
  std::optional<std::pair<double, double>> interval;
  std::optional<double> simulated;  ///< on its scale
};
/// compute_statistics() of all strokes, with intervals from so many bootstrap draws, and of each
/// cloth's strokes alone, in the order of the cloths' names. The views have the same strokes.
std::vector<SidedStatistic> compare_strokes(const RecordingView& recorded,
                                            const RecordingView& simulated, std::size_t draws,
                                            std::uint64_t seed);

}  // namespace weft::daemon::calibration
