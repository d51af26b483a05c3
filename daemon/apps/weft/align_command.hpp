#pragma once
// `weft align`: finds the plate's tilt by touching it, levels it with the two rotary stages, and
// touches again.

#include <cstdint>
#include <filesystem>
#include <optional>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/plugin_options.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

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
