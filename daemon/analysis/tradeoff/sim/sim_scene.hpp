#pragma once
// The scenes for comparing the plant's levels: a fabric, a probe and the motion of the stages. A
// scene is the same for every level, integrator and step, and for a reference by another solver.
// Here stages have neither quantum nor backlash, and the force loop uses the exact force. Otherwise
// a sensor's steps would hide the errors of the plant.

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

/// The slide in the scenes of `weft trade sim`: force and speed of Khan and others (000, section
/// III-B), and the plate height of the simulated bench.
namespace weft::daemon::paper_slide {

constexpr double set_n = 5;
constexpr double slide_mps = 2e-3;
constexpr double plate_z_m = 0.06;

}  // namespace weft::daemon::paper_slide

namespace weft::daemon {

/// The stages' time grid on a bench: one conversion of a taxel.
inline constexpr double sim_grid_s = 3.072e-3;
/// Time between samples: nine conversions, within 2 % of the sensor's frame of 1/37 s.
inline constexpr double sim_sample_s = 9 * sim_grid_s;

/// One stage: consecutive moves with limited acceleration.
class StagePath {
 public:
  explicit StagePath(double start_m = 0) : end_m_(start_m), start_m_(start_m) {}

  /// Adds a move from the end of the last one. It starts at `at_s`, which must not be before that
  /// end.
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

/// Regulates the normal force with the speed of z, once per sample.
struct SimForceLoop {
  double set_n = 5;
  double gain_mps_n = 5e-4;
  double fastest_mps = 1e-3;
  double from_s = 0;
};

/// One run.
struct SimCase {
  std::string name;  ///< name of the fabric
  sim::Patch patch;
  sim::ContactGeometry geometry;
  sim::Mount mount;
  sim::DynamicsParams dynamics;  ///< step and integrator are not used
  StagePath y, z;
  std::optional<SimForceLoop> loop;
  double grid_s = sim_grid_s;  ///< stages move linearly between these times; divides a sample
  std::size_t samples = 0;     ///< length of the run
  double cycle_from_s = 0, cycle_to_s = 0;  ///< interval for detecting a stick-slip cycle; 0: never
  bool slides = false;

  [[nodiscard]] bool cycles_at(double t_s) const { return t_s >= cycle_from_s && t_s < cycle_to_s; }
  [[nodiscard]] double duration_s() const { return static_cast<double>(samples) * sim_sample_s; }
  /// Grid points per sample.
  [[nodiscard]] std::size_t grid_points() const;
  /// The state before the run: stages at rest, probe hanging.
  [[nodiscard]] sim::ContactState start() const;
};

struct SimScene {
  std::string name;   ///< "press"
  std::string words;  ///< description of its course
  std::vector<SimCase> cases;
};

/// The motion of the stages during one run, controlled by the current force.
class SimDrive {
 public:
  explicit SimDrive(const SimCase& one) : case_(one) {}

  /// Pose of the stages at grid point `to` > `from`, with the force at `from`. Call in order of
  /// time, and at the first point of every sample.
  sim::Pose move(std::size_t from, std::size_t to, double normal_n);

 private:
  const SimCase& case_;
  double rate_mps_ = 0, offset_m_ = 0;
};

/// press, press_plain, slide, stick_slip, retouch, fabrics17.
const std::vector<std::string>& sim_scene_names();
/// Number of fabrics with `quick`.
inline constexpr std::size_t quick_fabrics = 3;
/// `quick` keeps the first quick_fabrics of fabrics17. Refuses another name and a table without
/// denim.
Result<SimScene> make_sim_scene(std::string_view name, const sim::FabricLibrary& library,
                                bool quick = false);

/// Differs between scenes that differ in any number; identifies scenes in files made from them.
std::string sim_fingerprint(const SimScene& scene);

}  // namespace weft::daemon
