#include "sim/plant/fidelity/forecast.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "sim/plant/bounds.hpp"

namespace weft::sim {
namespace {

constexpr double s_per_us = 1e-6;

/// Simulates one second of a probe that moves down onto the bare plate, with pads.
void probe_once() {
  constexpr std::uint64_t frames = 37;
  PlantParams params;
  Plant plant(params, 1);
  const double top_m = params.geometry.plate_z_m - 1e-3;
  plant.mount(bare_plate(), {.z_m = top_m});
  double done = 0;
  for (std::uint64_t frame = 0; frame < frames; ++frame)
    for (int stage = 0; stage < pad_timing::stages; ++stage) {
      done += 1.0 / (static_cast<double>(frames) * pad_timing::stages);
      plant.advance({.z_m = top_m + 2e-3 * done}, grid_step_s);
      plant.convert(stage, frame);
    }
}

}  // namespace

std::string format_times(double times_real_time) {
  constexpr double whole_from = 100;
  return printed(times_real_time >= whole_from ? "%.0fx" : "%.3gx", times_real_time);
}

std::string format_parts(const SpeedForecast& forecast) {
  constexpr double least_share = 0.05;
  std::array parts{std::pair{"plant", forecast.plant_s},
                   std::pair{"emulators", forecast.emulators_s},
                   std::pair{"drivers", forecast.drivers_s},
                   std::pair{"recorder", forecast.recorder_s},
                   std::pair{"error check", forecast.error_check_s},
                   std::pair{"export", forecast.export_s},
                   std::pair{"evaluation", forecast.evaluate_s}};
  std::ranges::stable_sort(parts, [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string out;
  for (const auto& [name, seconds] : parts)
    if (seconds >= least_share * forecast.total_s())
      out += (out.empty() ? "" : ", ") + std::string(name) +
             printed(" %.0f %%", 100 * seconds / forecast.total_s());
  return out;
}

SpeedForecast forecast(const HostCost& cost, const MeasuredSetting& setting, const RunSize& run,
                       double probe_us) {
  const double slower = probe_us > 0 && cost.probe_us > 0 ? probe_us / cost.probe_us : 1;
  const double scale = slower * s_per_us;
  const double trials = scale * static_cast<double>(run.trials);
  const double per_checked_us =
      run.is_fully_checked ? cost.full_check_us_per_s : cost.quick_check_us_per_s;
  const double pads_us = run.has_pads ? cost.pads_us_per_s : 0;
  return {.bench_s = run.bench_s,
          .plant_s = scale * run.bench_s * (setting.contact_us_per_s + pads_us),
          .emulators_s = scale * run.bench_s * cost.emulators_us_per_s,
          .drivers_s = scale * run.bench_s * cost.drivers_us_per_s,
          .recorder_s = scale * run.bench_s * cost.recorder_us_per_s,
          .error_check_s = scale * run.checked_s * per_checked_us,
          .export_s = trials * cost.export_us_per_trial,
          .evaluate_s = run.is_evaluated ? trials * cost.evaluate_us_per_trial : 0};
}

double measure_probe_us(const std::function<double()>& now_us) {
  constexpr int rounds = 5, seconds = 50;
  double best_us = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    const double began_us = now_us();
    for (int i = 0; i < seconds; ++i) probe_once();
    best_us = std::min(best_us, (now_us() - began_us) / seconds);
  }
  return best_us;
}

}  // namespace weft::sim
