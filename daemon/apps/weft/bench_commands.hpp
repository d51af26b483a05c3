#pragma once
// Commands on a rig without a campaign: `weft check`, `align`, `doctor`.

#include <cstdint>
#include <filesystem>
#include <optional>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/plugin_options.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

// `weft doctor`: the devices of a rig, its ports and the machine, and what to do about each.

struct DoctorArgs {
  std::filesystem::path rig;
  std::filesystem::path out = ".";
  double listen_s = 2;
  PluginArgs plugins;
};
void add_options(CLI::App& command, DoctorArgs& args);

/// exit_failure when there is a problem; warnings alone do not count.
Result<int> run_doctor(const DoctorArgs& args, Console& console);

// `weft check`: a recipe against a rig, without moving anything.

struct CheckArgs {
  std::filesystem::path recipe;
  std::filesystem::path rig;
  FidelityArgs fidelity;
  PluginArgs plugins;
};
void add_options(CLI::App& command, CheckArgs& args);

/// Prints plan, duration, bytes, envelope and margins. A refused recipe is not an error of this
/// function: all its problems are printed and exit_failure is returned.
Result<int> run_check(const CheckArgs& args, Console& console);

struct AlignArgs {
  std::filesystem::path rig;
  unsigned per_side = 3;
  std::optional<double> span_mm;
  std::optional<double> largest_tilt_deg;
  double contact_force_n = 0.1;
  double touch_speed_mm_s = 0.05;
  double largest_residual_um = 20;
  double tolerance_mrad = 0.1;
  std::uint64_t seed = 1;
  PluginArgs plugins;
};
void add_options(CLI::App& command, AlignArgs& args);

/// exit_failure, after a sentence, when the plate was not found, is no plane or was not levelled.
Result<int> run_align(const AlignArgs& args, Console& console);

}  // namespace weft::daemon::cli
