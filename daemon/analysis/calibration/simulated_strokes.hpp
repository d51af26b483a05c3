#pragma once
// Recorded strokes and the same strokes SIMULATED, as data sets and as statistics. Any program that
// reads data sets can then assess a calibrated table.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/analysis/calibration/statistics.hpp"
#include "sim/plant/fabric.hpp"

namespace weft::daemon::calibration {

/// The table with each label's calibrated fabric (name_in_table()) under the label only, before the
/// other fabrics, so that ClothModel selects it. For a label without one, ClothModel searches as
/// usual.
sim::FabricLibrary with_own_cloths(sim::FabricLibrary library, const RecordingView& view,
                                   const std::string& prefix);

/// The complete trials of `recorded`, each with the counts of its stroke: above the unloaded level,
/// whole numbers, all in phase M, only the channels of the view, times by the nominal rate. No
/// other streams. `view`: from make_recording_view() for `recorded` only, or from Scene::simulate()
/// for such a view.
Dataset stroke_dataset(const Dataset& recorded, const RecordingView& view, BenchKind kind);

/// Joins both, so that one side can train and the other test. Groups G become "recorded-G" and
/// "simulated-G", and file names get the same prefixes. Mountings of the second set are renumbered
/// after the first. Bench: unknown.
Dataset both_sides(Dataset recorded, Dataset simulated);

struct SidedStatistic {
  Statistic recorded;
  std::string strokes_of;  ///< only this fabric; empty: all
  /// 95 % interval of the recorded one on its scale; none for the strokes of one fabric.
  std::optional<std::pair<double, double>> interval;
  std::optional<double> simulated;  ///< on its scale
};
/// compute_statistics() of all strokes, with intervals from `draws` bootstrap draws, and of each
/// fabric's strokes, sorted by fabric name. Both views must have the same strokes.
std::vector<SidedStatistic> compare_strokes(const RecordingView& recorded,
                                            const RecordingView& simulated, std::size_t draws,
                                            std::uint64_t seed);

}  // namespace weft::daemon::calibration
