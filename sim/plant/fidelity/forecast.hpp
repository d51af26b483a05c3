#pragma once
// How fast a whole run will be, from what the table's machine needed and how fast this one is.

#include <functional>
#include <string>

#include "sim/plant/fidelity/table.hpp"

namespace weft::sim {

/// Of a run, by its plan.
struct RunSize {
  double bench_s = 1;
  std::size_t trials = 0;
  double checked_s = 0;           ///< bench time of the trials that are played again
  bool is_fully_checked = false;  ///< by two references, see run_error()
  bool has_pads = true;
  bool is_evaluated = true;
};

/// Wall time of the parts of a run [s], on a machine that does nothing else.
struct SpeedForecast {
  double bench_s = 0;
  double plant_s = 0, emulators_s = 0, drivers_s = 0, recorder_s = 0;
  double error_check_s = 0, export_s = 0, evaluate_s = 0;

  /// Until the record is closed: export and evaluation come after it.
  [[nodiscard]] double campaign_s() const {
    return plant_s + emulators_s + drivers_s + recorder_s + error_check_s;
  }
  [[nodiscard]] double total_s() const { return campaign_s() + export_s + evaluate_s; }
  /// Of the whole run.
  [[nodiscard]] double times_real_time() const { return bench_s / total_s(); }
  [[nodiscard]] double campaign_times_real_time() const { return bench_s / campaign_s(); }
};
/// "1905x", "13.6x".
std::string format_times(double times_real_time);
/// Parts of at least a twentieth, the largest first: "emulators 45 %, drivers 20 %".
std::string format_parts(const SpeedForecast& forecast);

/// `probe_us`: of this machine; 0: it is as fast as the table's.
SpeedForecast forecast(const HostCost& cost, const MeasuredSetting& setting, const RunSize& run,
                       double probe_us);

/// Processor time of a fixed piece of the plant's work, the best of some: how fast a machine is.
/// `now_us` is a clock of this thread's processor time, as the table's costs are.
double measure_probe_us(const std::function<double()>& now_us);

}  // namespace weft::sim
