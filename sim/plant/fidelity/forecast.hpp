#pragma once
// Forecast of the speed of a whole run, from the costs in the table and the speed of this machine.

#include <functional>
#include <string>

#include "sim/plant/fidelity/table.hpp"

namespace weft::sim {

/// Size of a run, from its plan.
struct RunSize {
  double bench_s = 1;
  std::size_t trials = 0;
  double checked_s = 0;           ///< bench time of the trials that are replayed
  bool is_fully_checked = false;  ///< with two references, see run_error()
  bool has_pads = true;
  bool is_evaluated = true;
};

/// Wall time of the parts of a run [s], on a machine without other load.
struct SpeedForecast {
  double bench_s = 0;
  double plant_s = 0, emulators_s = 0, drivers_s = 0, recorder_s = 0;
  double error_check_s = 0, export_s = 0, evaluate_s = 0;

  /// Time until the record is closed; export and evaluation come later.
  [[nodiscard]] double campaign_s() const {
    return plant_s + emulators_s + drivers_s + recorder_s + error_check_s;
  }
  [[nodiscard]] double total_s() const { return campaign_s() + export_s + evaluate_s; }
  /// Speed of the whole run.
  [[nodiscard]] double times_real_time() const { return bench_s / total_s(); }
  [[nodiscard]] double campaign_times_real_time() const { return bench_s / campaign_s(); }
};
/// "1905x", "13.6x".
std::string format_times(double times_real_time);
/// Parts of at least a twentieth, the largest first: "emulators 45 %, drivers 20 %".
std::string format_parts(const SpeedForecast& forecast);

/// `probe_us`: of this machine; 0: as fast as the table's machine.
SpeedForecast forecast(const HostCost& cost, const MeasuredSetting& setting, const RunSize& run,
                       double probe_us);

/// Speed of this machine: processor time of a fixed piece of the plant's work [us], the best of
/// several. `now_us` must be a clock of this thread's processor time, as for the costs of the
/// table.
double measure_probe_us(const std::function<double()>& now_us);

}  // namespace weft::sim
