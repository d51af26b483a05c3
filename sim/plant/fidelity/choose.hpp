#pragma once
// Chooses a setting from the table. Criteria: its promise for the fabrics and forces of a plan, and
// the speed of the whole run.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/fabric.hpp"
#include "sim/plant/fidelity/forecast.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {

struct FidelityRequest {
  std::optional<double> accuracy_n{};       ///< largest error of the recorded force
  std::optional<double> times_real_time{};  ///< least speed of the whole run
  std::optional<Level> level{};             ///< only this level
  std::optional<double>
      promise_below_n{};  ///< upper limit of the promise, after one that was exceeded
  RunSize run{};
  double probe_us = 0;  ///< of this machine; 0: as fast as the table's machine
};

/// Contact conditions of a plan on its rig.
struct ForceScene {
  std::vector<std::string> fabrics;
  MeasuredRange force_n{};    ///< set points; both 0: no force is regulated
  MeasuredRange speed_mps{};  ///< speed of the strokes; both 0: no strokes
  MeasuredRange press_s{};    ///< duration of phases P; both 0: no presses
  double seat_speed_mps = 0;
  double face_area_m2 = 0;
  Mount mount;
  const FabricLibrary* library = nullptr;  ///< for fabrics without a row; null: there are none
  /// The rows of the table are for these fabrics. False: no fabric has a row.
  bool has_rows = true;
};

/// Force scale of a touch-down: v sqrt(K m) of a mass on a spring, with the stiffness of the fabric
/// under its load, K = (F + A p_s)/lambda.
double impact_scale_n(const FabricLaw& law, const Mount& mount, double seat_speed_mps,
                      double force_n, double face_area_m2);

struct FidelityOffer {
  FidelitySetting setting;
  double promise_n = 0;  ///< margin times the largest error measured on the plan's fabrics
  std::string limiting_fabric;
  SpeedForecast forecast{};
};
/// "L2 midpoint 0.384 ms (promises 2.1 mN, about 1200x)".
std::string to_string(const FidelityOffer& offer);

/// Settings that a bench can run and that provide the scene, fastest first. Ties: the lower level,
/// then the longer step. Errors: unsupported, for a force, speed, press or mount outside the
/// table's ranges, with the range; not_found, for a fabric that has no row and is not in the
/// library.
Result<std::vector<FidelityOffer>> offers(const FidelityTable& table, const Scene& scene,
                                          const ForceScene& forces, const FidelityRequest& request);

/// A forecast must exceed the requested speed by this factor, because wall time depends on load.
constexpr double forecast_reserve = 1.1;

/// With an accuracy: the fastest setting that promises it. With only a speed: the most accurate
/// setting with a forecast of the whole run that is forecast_reserve times as fast. Pure. Errors:
/// those of offers(); unsupported, with the nearest offer or the fastest speed.
Result<FidelityOffer> choose(const FidelityTable& table, const Scene& scene,
                             const ForceScene& forces, const FidelityRequest& request);

/// "10mN", "0.01 N", "0.5%" (of 5 N, the paper's load), in N. Errors: invalid_argument, range.
Result<double> parse_accuracy_n(std::string_view text);
/// "1000x". Errors: invalid_argument, range.
Result<double> parse_times_real_time(std::string_view text);

}  // namespace weft::sim
