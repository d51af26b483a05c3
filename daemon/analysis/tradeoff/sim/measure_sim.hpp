#pragma once
// `weft trade sim`: every level, integrator and step on every scene; error against references, and
// processor time of the same runs. Trajectories of scenes can be stored in a file (JSON), so that
// an external solver can be the reference: tests/bench/peers/sim_reference.cc makes one with
// SUNDIALS CVODE.

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/tradeoff/sim/sim_run.hpp"

namespace weft::daemon {

// Difference between two runs of the same scene.

/// Maximum and root mean square over the samples.
struct SimDeviation {
  double max = 0;
  double rms = 0;
};

struct SimError {
  SimDeviation force_n;              ///< of the force vector: normal and both tangential components
  SimDeviation normal_n;             ///< of the normal component
  std::optional<SimDeviation> pads;  ///< over all taxels, if both runs have counts [LSB]
  std::optional<double> touch_s;     ///< largest difference of touch-down times; nothing if the run
                                     ///< has none or another number
};

/// Both runs must have the case's samples.
SimError measure_error(const SimTrace& run, const SimTrace& reference);

/// The effect of level L3 beyond L2: the force on the plate from the surface's waves and
/// asperities, at the face positions of a run's samples. Zero for a scene without sliding.
Result<SimDeviation> rubbing_force(const SimCase& one, const SimTrace& run);

/// The reason if a run has failed, otherwise empty. `one`: the scene's case.
std::string find_failure(const SimCase& one, const SimTrace& run, const SimTrace& reference);

/// Reference trajectories of one scene, one per case.
struct SimReference {
  std::string words;  ///< how they were made
  std::vector<SimTrace> traces;
};

/// Error against one reference: the worst case, and the median over the cases.
struct SimErrors {
  SimDeviation worst_n, median_n;  ///< force vector
  SimDeviation normal_n;           ///< worst case, normal component
  std::optional<SimDeviation> pads_lsb;
  std::optional<double> touch_s;
};

/// One setting on one scene.
struct SimPoint {
  SimSetting setting;
  SimErrors total;                          ///< against the reference, which has level L2
  std::optional<SimErrors> discretisation;  ///< against the finest run of the same level
  std::optional<SimErrors> model;           ///< of that finest run, against the next higher level
  SimCycle cycle;
  std::string failure;              ///< reason for exclusion from the comparison; empty: included
  std::vector<double> timings_s;    ///< processor time of the whole scene without setup
  double best_s = 0, median_s = 0;  ///< per simulated second
  double setup_s = 0;               ///< processor time to make the models of all cases
  bool front = false;               ///< no other setting is as accurate (largest total error) in
                                    ///< less time
};

/// A setting without any result, and the reason.
struct SimRefusal {
  SimSetting setting;
  std::string why;
};

struct SimSceneResult {
  std::string scene, words, reference;
  std::size_t cases = 0;
  double simulated_s = 0;
  SimCycle cycle;                           ///< the reference's
  std::optional<SimDeviation> agreement_n;  ///< of the finest run of L2 with the reference
  std::vector<SimPoint> points;
  std::vector<SimRefusal> refusals;
};

struct SimTradeoffOptions {
  std::vector<std::string> scenes;                 ///< empty: all
  std::map<std::string, SimReference> references;  ///< by scene; default: the finest run of L2
  std::size_t timings = 7;                         ///< at least 1, which is sufficient for tests
  bool quick = false;                              ///< few steps, three fabrics
};

using SimProgress = std::function<void(const std::string&)>;

/// `cpu_seconds`: processor time of this thread or process.
Result<std::vector<SimSceneResult>> measure_sim_tradeoff(const sim::FabricLibrary& library,
                                                         const SimTradeoffOptions& options,
                                                         const std::function<double()>& cpu_seconds,
                                                         const SimProgress& progress = {});

struct ReferenceScene {
  const SimScene& scene;
  const std::vector<SimTrace>& traces;  ///< one per case
};

std::string write_references(const std::string& made_by, std::span<const ReferenceScene> scenes);

/// References by scene, for `scenes` only; other scenes of the file are skipped. Errors: parse,
/// with the place; invalid_argument for trajectories of other scenes (another fabric table, another
/// version of the scenes).
Result<std::map<std::string, SimReference>> read_references(std::string_view json,
                                                            std::span<const SimScene> scenes);

}  // namespace weft::daemon
