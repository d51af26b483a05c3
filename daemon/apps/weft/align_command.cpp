#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/align_run.hpp"
#include "protocols/base/time.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

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

constexpr double urad_per_rad = 1e6;
constexpr double mrad = 1e-3;

std::string degrees(double rad) {
  return fixed(rad / rad_per_deg, 4);
}

std::string micrometres(double m) {
  return fixed(m / m_per_um, 2) + " um";
}

/// Adds one round as a row of the table.
void add_row(Table& table, const std::string& name, const recipes::TiltFound& found) {
  table.row({name, degrees(found.tilt_x_rad), degrees(found.tilt_y_rad),
             fixed(found.lean_rad * urad_per_rad, 1), fixed(found.lean_sd_rad * urad_per_rad, 1),
             micrometres(found.plane.residual_rms_m), micrometres(found.plane.residual_worst_m),
             std::to_string(found.plane.points)});
}

/// Banner of a bench that is not real; empty for a real bench.
std::string align_banner(BenchKind bench) {
  if (bench == BenchKind::real) return {};
  return "SIMULATED: the plate is part of the plant model; nothing real was touched.\n";
}

std::string format_text(const AlignSummary& s) {
  std::string out = align_banner(s.bench) + "Alignment of " + s.rig_name + ": " +
                    std::string(recipes::to_string(s.done.outcome)) + ", clean-up " +
                    std::string(recipes::to_string(s.done.cleanup)) + ", rig " +
                    std::string(recipes::to_string(s.done.rig)) + "\n";
  if (s.rounds.empty()) return out + "  no tilt measured\n";
  Table table(Align::right);
  table.row({"", "about x deg", "about y deg", "total urad", "sd urad", "residual rms", "worst",
             "touches"});
  add_row(table, "measured tilt", s.rounds.front());
  for (std::size_t i = 1; i < s.rounds.size(); ++i)
    add_row(table, i + 1 == s.rounds.size() ? "remaining tilt" : "intermediate", s.rounds[i]);
  out += table.text();
  const recipes::Tilts& at = s.rounds.back().stages;
  return out + "  rotary stages at rx " + degrees(at.rx_rad) + " deg, ry " + degrees(at.ry_rad) +
         " deg; bench time " + duration(s.bench_s) + "\n";
}

json round_json(const recipes::TiltFound& f) {
  return {{"tilt_x_rad", f.tilt_x_rad},
          {"tilt_y_rad", f.tilt_y_rad},
          {"lean_rad", f.lean_rad},
          {"lean_sd_rad", f.lean_sd_rad},
          {"residual_rms_m", f.plane.residual_rms_m},
          {"residual_worst_m", f.plane.residual_worst_m},
          {"touches", f.plane.points},
          {"rx_rad", f.stages.rx_rad},
          {"ry_rad", f.stages.ry_rad},
          {"level_rx_rad", f.level.rx_rad},
          {"level_ry_rad", f.level.ry_rad}};
}

json json_of(const AlignSummary& s) {
  json out{{"command", "align"},
           {"rig", s.rig_name},
           {"bench", to_string(s.bench)},
           {"outcome", recipes::to_string(s.done.outcome)},
           {"cleanup", recipes::to_string(s.done.cleanup)},
           {"rig_fact", recipes::to_string(s.done.rig)},
           {"tolerance_rad", s.plan.tolerance_rad},
           {"bench_time_s", s.bench_s},
           {"measured_unix_s", s.measured_unix_s}};
  out["rounds"] = json::array();
  for (const recipes::TiltFound& round : s.rounds) out["rounds"].push_back(round_json(round));
  out["before"] = s.rounds.empty() ? json(nullptr) : round_json(s.rounds.front());
  out["after"] = s.rounds.empty() ? json(nullptr) : round_json(s.rounds.back());
  out["align_error"] = s.done.error ? error_json(*s.done.error) : json(nullptr);
  return out;
}

AlignRequest request_of(const AlignArgs& args, const StopSignals& signals, Console& console) {
  AlignRequest request;
  request.rig = args.rig;
  request.seed = args.seed;
  request.plugins = make_settings(args.plugins, console);
  request.stop = &signals.requested();
  recipes::AlignSettings& s = request.settings;
  s.per_side = args.per_side;
  if (args.span_mm) s.span_m = *args.span_mm * m_per_mm;
  if (args.largest_tilt_deg) s.largest_tilt_rad = *args.largest_tilt_deg * rad_per_deg;
  s.contact_force_n = args.contact_force_n;
  s.touch_speed_mps = args.touch_speed_mm_s * m_per_mm;
  s.largest_residual_m = args.largest_residual_um * m_per_um;
  s.tolerance_rad = args.tolerance_mrad * mrad;
  request.device_log = [&console](const DeviceLogEntry& line) { print_device_log(line, console); };
  return request;
}

void add_options(CLI::App& command, AlignArgs& args) {
  command.add_option("--rig", args.rig, "use this rig file (JSON)")->required();
  command
      .add_option("--points", args.per_side,
                  "touch this number of points along each side of the grid, 2 to 9")
      ->capture_default_str();
  command.add_option("--span-mm", args.span_mm,
                     "set the side of the grid around the middle of the plate");
  command.add_option("--max-tilt-deg", args.largest_tilt_deg,
                     "search for a tilt of at most this angle");
  command.add_option("--contact-force-n", args.contact_force_n, "detect a touch at this force")
      ->capture_default_str();
  command.add_option("--touch-speed-mm-s", args.touch_speed_mm_s, "touch at this speed")
      ->capture_default_str();
  command
      .add_option("--max-residual-um", args.largest_residual_um,
                  "refuse a surface that deviates more than this from a plane")
      ->capture_default_str();
  command.add_option("--tolerance-mrad", args.tolerance_mrad, "accept this remaining tilt")
      ->capture_default_str();
  command.add_option("--seed", args.seed, "set the seed of the sensors of a simulated bench")
      ->capture_default_str();
  add_options(command, args.plugins);
}

/// Returns exit_failure, after a sentence, if the plate was not found, is not flat or was not
/// levelled.
Result<int> run_align(const AlignArgs& args, Console& console) {
  const StopSignals signals;
  const Result<AlignSummary> summary = run_alignment(request_of(args, signals, console));
  if (!summary && signals.number() == 0) return pass(summary.error());
  if (!summary) {
    report(console, summary.error());
    return exit_signal + signals.number();
  }
  if (summary->done.error) console.err << "weft: " << to_string(*summary->done.error) << '\n';
  if (const auto left = format_rig(summary->done.cleanup, summary->done.rig); !left.empty())
    console.err << "weft: " << left << '\n';
  print(console, format_text(*summary), json_of(*summary));
  if (signals.number() != 0) return exit_signal + signals.number();
  return summary->done.outcome == recipes::Outcome::complete ? exit_ok : exit_failure;
}

}  // namespace

void add_align_command(const CommandGroup& weft) {
  weft.add<AlignArgs>("align", run_align);
}

}  // namespace weft::daemon::cli
