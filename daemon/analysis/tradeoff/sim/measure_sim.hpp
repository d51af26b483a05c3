#pragma once
// `weft trade sim`: every level, integrator and step on every scene; error against references and
// processor time of the same runs. Trajectories of scenes as a file (JSON), so that a solver that
// is no part of Weft can be the reference: tests/bench/peers/sim_reference.cc makes one with
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

// How far one run is from another of the same scene.

/// Largest and root mean square over the samples.
struct SimDeviation {
  double max = 0;
  double rms = 0;
};

struct SimError {
  SimDeviation force_n;              ///< of the force as a vector: normal and both tangential parts
  SimDeviation normal_n;             ///< of its normal part
  std::optional<SimDeviation> pads;  ///< of all pads, where both runs have counts [LSB]
  std::optional<double>
      touch_s;  ///< largest of the touch-downs; nothing without or where some miss
};

/// Both runs have the case's samples.
SimError measure_error(const SimTrace& run, const SimTrace& reference);

/// What level L3 knows beyond L2: the force that the surface's waves and asperities add on the
/// plate where the face is at a run's samples. Nothing of it for a scene without sliding.
Result<SimDeviation> rubbing_force(const SimCase& one, const SimTrace& run);

/// Why a run counts as failed; empty for one that does not. `one` is the scene's.
std::string find_failure(const SimCase& one, const SimTrace& run, const SimTrace& reference);

/// Trajectories of one scene that every run is compared with, one per case.
struct SimReference {
  std::string words;  ///< how they were made
  std::vector<SimTrace> traces;
};

/// Error against one reference: the worst case, and the median over the cases.
struct SimErrors {
  SimDeviation worst_n, median_n;  ///< force as a vector
  SimDeviation normal_n;           ///< worst case, normal part
  std::optional<SimDeviation> pads_lsb;
  std::optional<double> touch_s;
};

/// One setting on one scene.
struct SimPoint {
  SimSetting setting;
  SimErrors total;                          ///< against the reference of level L2
  std::optional<SimErrors> discretisation;  ///< against the finest run of the same level
  std::optional<SimErrors> model;           ///< of that finest run, against the next level up
  SimCycle cycle;
  std::string failure;              ///< why it is out of the comparison; empty: it is in
  std::vector<double> timings_s;    ///< processor seconds of the whole scene, setup apart
  double best_s = 0, median_s = 0;  ///< per simulated second
  double setup_s = 0;               ///< processor seconds to make the models of all cases
  bool front = false;               ///< none is as accurate (total, worst, largest) in less time
};

/// A setting without any result.
struct SimRefusal {
  SimSetting setting;
  std::string why;
};

struct SimSceneResult {
  std::string scene, words, reference;
  std::size_t cases = 0;
  double simulated_s = 0;
  SimCycle cycle;                           ///< of the reference
  std::optional<SimDeviation> agreement_n;  ///< of the finest run of L2 with the reference
  std::vector<SimPoint> points;
  std::vector<SimRefusal> refusals;
};

struct SimTradeoffOptions {
  std::vector<std::string> scenes;                 ///< all where empty
  std::map<std::string, SimReference> references;  ///< by scene; else the finest run of L2
  std::size_t timings = 7;                         ///< at least 1; tests need no more
  bool quick = false;                              ///< few steps, three cloths
};

using SimProgress = std::function<void(const std::string&)>;

/// `cpu_seconds` is the time of this thread or process alone.
Result<std::vector<SimSceneResult>> measure_sim_tradeoff(const sim::FabricLibrary& library,
                                                         const SimTradeoffOptions& options,
                                                         const std::function<double()>& cpu_seconds,
                                                         const SimProgress& progress = {});

struct ReferenceScene {
  const SimScene& scene;
  const std::vector<SimTrace>& traces;  ///< one per case
};

std::string write_references(const std::string& made_by, std::span<const ReferenceScene> scenes);

/// By scene, for the scenes that `library` makes; scenes of the file that are not asked for are
/// skipped. Errors: parse, with where; invalid_argument for trajectories of other scenes than
/// these (another cloth table, another version of the scenes).
Result<std::map<std::string, SimReference>> read_references(std::string_view json,
                                                            std::span<const SimScene> scenes);

}  // namespace weft::daemon
