#pragma once
// Limits and constants of a rig for planning: read once from the rig file, in SI units.

#include <algorithm>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"
#include "recipes/kinematics/kinematics.hpp"

namespace weft::recipes {

/// Largest age of a reading before the bench counts as blind [s]: ten periods of its stream, and at
/// least the delay of a busy host and a network.
constexpr double most_age_s(double rate_hz, double least_s) {
  return std::max(10 / rate_hz, least_s);
}

/// A tactile array. A recorded frame has the taxels of all arrays of the rig, one after the other.
struct TaxelArray {
  std::string device;  ///< its name in the rig file
  std::size_t taxels = 16;
  double rate_hz = 37;
  /// Positions of the taxels, if the rig file has them: rows and columns, row by row, or positions
  /// on the face relative to its middle.
  std::size_t rows = 0, cols = 0;
  std::vector<Vec2> places_m;
  /// Rise of a taxel above its rest value at full colour of the page, from calibration; 0: unknown.
  std::uint16_t span_counts = 0;
};

/// Bounds and constants of one rig.
struct RigLimits {
  std::string name;
  std::string bench;  ///< "simulated", "emulated" or "real"
  Geometry geometry;
  double max_speed_mps = 4e-3;  ///< all linear axes; the paper's stages reach 4 mm/s
  double max_acceleration_mps2 = 20e-3;
  double max_tilt_speed_radps = 0.1;  ///< rotary stages
  bool has_wrench = true;             ///< false: no force is measured, held or guarded, see below
  double force_cap_n = 10;
  double torque_cap_nm = 2;
  // For a rig without a force sensor: the change of the taxels since the probe hung free shows a
  // touch and an overload.
  double touch_counts = 0;        ///< mean change that counts as a touch
  double taxel_cap_counts = 0;    ///< largest change of a taxel; more fails the trial
  double most_press_depth_m = 0;  ///< largest z below the touch
  double frozen_wrench_s = 0.25;  ///< unchanged readings are faulty after this; 0: not checked
  double frozen_taxels_s = 1;
  double probe_weight_n = 0.2 * 9.80665;  ///< weight on the fabric when nothing pushes the probe
  /// z continues by this distance after the fabric carries the weight, or after the taxels' touch.
  double rest_travel_m = 0.5e-3;
  /// Travel of z between the stop on which the probe hangs and its mount's spring, both without
  /// load. Within it the fabric carries the weight alone. Nullopt if unknown: a real rig that does
  /// not state it.
  std::optional<double> slack_m;
  /// At the lower end of the slack the probe hangs on a stop that can carry a part of its weight.
  /// Forces below the weight can then be regulated.
  bool hangs_on_stop = false;
  double rest_tolerance = 0.05;    ///< of the weight: allowed deviation in phases S and E
  Vec2 footprint_m{16e-3, 16e-3};  ///< the probe's face, centred on the contact point
  double clearance_m = 8e-3;  ///< height above the plate for transfers: above the thickest fabric
  double cycle_hz = 100;      ///< scan cycle of controller and guards
  /// Sum over all arrays; 0: no device has the role, and data sets have the wrench only.
  std::size_t taxels = 16;
  std::vector<TaxelArray> taxel_arrays;  ///< in the order of the rig file
  bool imprint_array = false;  ///< the taxels are the rows and columns of an imprint array
  /// Rates of the sensors' streams, as their drivers are configured. With several tactile arrays it
  /// is that of the first. Without taxels it is that of the wrench, and its readings then carry the
  /// phase.
  double taxel_rate_hz = 37;
  double wrench_rate_hz = 100;
  /// False: simulated without noise, see lacks_noise(). Equal readings are then no fault, and
  /// frozen_wrench_s or frozen_taxels_s is 0.
  bool wrench_noise = true, taxel_noise = true;
  double acceleration_rate_hz = 0;  ///< of the vibration sensor, if the rig has one
  double sound_rate_hz = 0;
  /// Angles of the rotary stages that level the plate under the probe, from weft align; campaigns
  /// keep them. The tilt of the plate about the weft remains, and the probe tilts with it.
  Tilts level;
  Joints park;  ///< target of a park for x, y, rx and ry; z is not read from the rig file
  std::vector<std::string> fabrics;  ///< fabrics the rig can mount; empty: any

  /// Positions are recorded once in this number of cycles, all axes in one row.
  static constexpr unsigned cycles_per_stage_row = 5;
  /// Largest allowed age of the newest frame of any array [s].
  [[nodiscard]] double most_taxel_age_s() const { return most_age_s(slowest_taxel_rate_hz(), 0.5); }
  /// Rate that the driver of a device with this role is configured with; 0: none.
  [[nodiscard]] double stream_rate_hz(std::string_view role, std::string_view device) const;
  /// Rate of the slowest tactile array.
  [[nodiscard]] double slowest_taxel_rate_hz() const;
  [[nodiscard]] double stage_rate_hz() const { return cycle_hz / cycles_per_stage_row; }

  /// Least set point of the force loop: the least force above the sensor's noise, or the probe's
  /// weight.
  [[nodiscard]] double least_force_n() const { return hangs_on_stop ? 0.1 : probe_weight_n; }
  [[nodiscard]] bool levelled() const { return level.rx_rad != 0 || level.ry_rad != 0; }
  /// Rise of the plate from its middle to its edge when it tilts as the probe does.
  [[nodiscard]] double level_rise_m() const;
  /// z stage position for transfers: the probe clears the fabric everywhere on the plate.
  [[nodiscard]] double clear_z_m() const {
    return geometry.surface_z_m - clearance_m - level_rise_m();
  }
};

inline constexpr std::string_view force_bounds_reason =
    "from the least force of the probe mount to the cap of the rig";

/// Whether the device of this role ("wrench", "taxels") of a rig file is simulated without noise.
/// For a force sensor its emulator has `noise_scale` 0; for an array /simulation/pads has
/// `noise_counts` 0. Never on a real bench.
bool lacks_noise(const nlohmann::json& rig, std::string_view role);

/// Reads the keys of a rig file that concern planning and ignores the others. Errors: one that
/// lists every problem, one sentence per line, each with its JSON pointer.
Result<RigLimits> parse_rig_limits(std::string_view rig_json);

}  // namespace weft::recipes
