#pragma once
// What a rig can do, as far as planning needs it: read once from the rig file, SI inside.

#include <algorithm>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"
#include "recipes/kinematics/kinematics.hpp"

namespace weft::recipes {

/// How old a reading may be before the bench counts as blind [s]: ten periods of its stream, and
/// not less than what a busy host and a network may cost.
constexpr double most_age_s(double rate_hz, double least_s) {
  return std::max(10 / rate_hz, least_s);
}

/// A tactile array. A recorded frame has the taxels of all arrays of the rig, one after the other.
struct TaxelArray {
  std::string device;  ///< its name in the rig file
  std::size_t taxels = 16;
  double rate_hz = 37;
  /// How the taxels lie, where the rig file says so: rows and columns, row by row, or places on the
  /// face, from its middle.
  std::size_t rows = 0, cols = 0;
  std::vector<Vec2> places_m;
  /// Rise of one taxel over its rest at full colour of the page, by calibration; 0: not said.
  std::uint16_t span_counts = 0;
};

/// Bounds and constants of one rig.
struct RigLimits {
  std::string name;
  std::string bench;  ///< "simulated", "emulated" or "real"
  Geometry geometry;
  double max_speed_mps = 4e-3;  ///< any linear axis; the paper's stages reach 4 mm/s
  double max_acceleration_mps2 = 20e-3;
  double max_tilt_speed_radps = 0.1;  ///< rotary stages
  bool has_wrench = true;             ///< false: no force is measured, held or guarded, see below
  double force_cap_n = 10;
  double torque_cap_nm = 2;
  // Of a rig without a force sensor: the taxels show a touch, and how much is too much, by their
  // change since the probe hung free.
  double touch_counts = 0;        ///< mean change that is a touch
  double taxel_cap_counts = 0;    ///< largest change of a taxel; more fails the trial
  double most_press_depth_m = 0;  ///< z goes no further below where it touched
  double frozen_wrench_s = 0.25;  ///< readings that stay the same for so long are not; 0: never
  double frozen_taxels_s = 1;
  double probe_weight_n = 0.2 * 9.80665;  ///< on the cloth when nothing pushes the probe
  /// z goes on this far after the cloth bears the probe's weight, or after the taxels' touch.
  double rest_travel_m = 0.5e-3;
  /// How far z moves between the stop that the probe hangs on and its mount's spring, both without
  /// load: there the cloth bears the weight alone. Not stated on a real rig: not known.
  std::optional<double> slack_m;
  /// At the lower end of the slack the probe hangs on a stop that can carry a part of its weight:
  /// forces below the weight can be held.
  bool hangs_on_stop = false;
  double rest_tolerance = 0.05;    ///< of the weight: how far off it phases S and E may be
  Vec2 footprint_m{16e-3, 16e-3};  ///< the probe's face, centred on the contact point
  double clearance_m = 8e-3;  ///< height above the plate for transfers: over the thickest cloth
  double cycle_hz = 100;      ///< scan cycle of controller and guards
  /// Of all arrays; 0: no device has the role, and data sets are of the wrench alone.
  std::size_t taxels = 16;
  std::vector<TaxelArray> taxel_arrays;  ///< in the order of the rig file
  bool imprint_array = false;  ///< the taxels are rows and columns of an array that keeps imprints
  /// Of the sensors' streams, as their drivers are configured; of several tactile arrays the first
  /// one's. Without taxels the wrench's, whose readings then carry the phase.
  double taxel_rate_hz = 37;
  double wrench_rate_hz = 100;
  /// False: simulated without noise, see lacks_noise(). Equal readings are then no fault, and
  /// frozen_wrench_s or frozen_taxels_s is 0.
  bool wrench_noise = true, taxel_noise = true;
  double acceleration_rate_hz = 0;  ///< of the vibration sensor, where the rig has one
  double sound_rate_hz = 0;
  /// Of the rotary stages that put the plate level under the probe, as weft align found them: where
  /// campaigns hold them. The plate's own lean about the weft stays, and the probe's with it.
  Tilts level;
  Joints park;  ///< where park leaves x, y, rx and ry; z is not read from the rig file
  std::vector<std::string> fabrics;  ///< names the rig can mount; empty when it takes any

  /// Positions are recorded, all axes in one row, once in so many cycles.
  static constexpr unsigned cycles_per_stage_row = 5;
  /// How old the newest frame of any array may be [s].
  [[nodiscard]] double most_taxel_age_s() const { return most_age_s(slowest_taxel_rate_hz(), 0.5); }
  /// What the driver of a device with this role is told of its stream; 0: nothing.
  [[nodiscard]] double stream_rate_hz(std::string_view role, std::string_view device) const;
  /// Of the tactile array that sends least often.
  [[nodiscard]] double slowest_taxel_rate_hz() const;
  [[nodiscard]] double stage_rate_hz() const { return cycle_hz / cycles_per_stage_row; }

  /// Least set point of the force loop: what the sensor tells from nothing, or the probe's weight.
  [[nodiscard]] double least_force_n() const { return hangs_on_stop ? 0.1 : probe_weight_n; }
  [[nodiscard]] bool levelled() const { return level.rx_rad != 0 || level.ry_rad != 0; }
  /// How far a plate that leans as the probe does rises from its middle to its edge.
  [[nodiscard]] double level_rise_m() const;
  /// z stage position for transfers: the probe clears the cloth everywhere on the plate.
  [[nodiscard]] double clear_z_m() const {
    return geometry.surface_z_m - clearance_m - level_rise_m();
  }
};

inline constexpr std::string_view force_bounds_reason =
    "from what the probe's mount can hold to the rig's cap";

/// Whether the device of this role ("wrench", "taxels") of a rig file is simulated without noise: a
/// force sensor's emulator with `noise_scale` 0, a tactile one's where /simulation/pads has
/// `noise_counts` 0. Never on a real bench.
bool lacks_noise(const nlohmann::json& rig, std::string_view role);

/// Reads the keys of a rig file that concern planning; keys that belong to others are left alone.
/// The error lists every problem, one sentence a line, each with its JSON pointer.
Result<RigLimits> parse_rig_limits(std::string_view rig_json);

}  // namespace weft::recipes
