#pragma once
// The scenes on which the plant's levels are compared: a cloth, a probe and what the stages do. A
// scene is the same for every level, integrator and step, and for a reference by another solver.
// Stages have neither quantum nor play here, and the force loop sees the force as it is, so that
// errors of the plant are not lost among a sensor's steps.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"
#include "sim/plant/contact.hpp"
#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/stage.hpp"

/// The slide that the scenes of `weft trade sim` are about: what Khan and others press and how fast
/// they go (000, section III-B), and where the plate lies on the simulated bench.
namespace weft::daemon::paper_slide {

constexpr double set_n = 5;
constexpr double slide_mps = 2e-3;
constexpr double plate_z_m = 0.06;

}  // namespace weft::daemon::paper_slide

namespace weft::daemon {

/// The stages' grid on a bench: one conversion of a pad.
inline constexpr double sim_grid_s = 3.072e-3;
/// Between samples: nine conversions, the sensor's frame of 1/37 s to 2 %.
inline constexpr double sim_sample_s = 9 * sim_grid_s;

/// One stage: moves with limited acceleration, one after the other.
class StagePath {
 public:
  explicit StagePath(double start_m = 0) : end_m_(start_m), start_m_(start_m) {}

  /// From where the last move ends, beginning at `at_s`, which must not lie before its end.
  void move(double at_s, double to_m, double speed_mps);
  [[nodiscard]] double at(double t_s) const;
  [[nodiscard]] double end_s() const;

 private:
  struct Move {
    double at_s;
    sim::Profile profile;
  };
  std::vector<Move> moves_;
  double end_m_, start_m_;
};

/// Holds the normal force by the speed of z, once per sample.
struct SimForceLoop {
  double set_n = 5;
  double gain_mps_n = 5e-4;
  double fastest_mps = 1e-3;
  double from_s = 0;
};

/// One run.
struct SimCase {
  std::string name;  ///< of the cloth
  sim::Patch patch;
  sim::ContactGeometry geometry;
  sim::Mount mount;
  sim::DynamicsParams dynamics;  ///< all but step and integrator
  StagePath y, z;
  std::optional<SimForceLoop> loop;
  double grid_s =
      sim_grid_s;           ///< stages move in straight lines between its times; divides a sample
  std::size_t samples = 0;  ///< run's length in samples
  double cycle_from_s = 0, cycle_to_s = 0;  ///< when a stick-slip cycle is looked for; 0: never
  bool slides = false;

  [[nodiscard]] bool cycles_at(double t_s) const { return t_s >= cycle_from_s && t_s < cycle_to_s; }
  [[nodiscard]] double duration_s() const { return static_cast<double>(samples) * sim_sample_s; }
  /// Of a sample.
  [[nodiscard]] std::size_t grid_points() const;
  /// The stages at rest before the run, the probe hanging.
  [[nodiscard]] sim::ContactState start() const;
};

struct SimScene {
  std::string name;   ///< "press"
  std::string words;  ///< what happens in it
  std::vector<SimCase> cases;
};

/// What the stages do of one run, told the force as it comes about.
class SimDrive {
 public:
  explicit SimDrive(const SimCase& one) : case_(one) {}

  /// Where the stages are at grid point `to` > `from`, under the force at `from`. Points are asked
  /// for in order, and every sample's first one is among them.
  sim::Pose move(std::size_t from, std::size_t to, double normal_n);

 private:
  const SimCase& case_;
  double rate_mps_ = 0, offset_m_ = 0;
};

/// press, press_plain, slide, stick_slip, retouch, fabrics17.
const std::vector<std::string>& sim_scene_names();
/// Cloths of a quick look.
inline constexpr std::size_t quick_fabrics = 3;
/// `quick` keeps the first quick_fabrics of fabrics17. Refuses another name and a table without
/// denim.
Result<SimScene> make_sim_scene(std::string_view name, const sim::FabricLibrary& library,
                                bool quick = false);

/// Tells scenes apart that differ in any number; for files made of them.
std::string sim_fingerprint(const SimScene& scene);

}  // namespace weft::daemon
