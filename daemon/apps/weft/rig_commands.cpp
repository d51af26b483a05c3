#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/apps/weft/daemon_call.hpp"
#include "protocols/base/time.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct JogArgs : SocketArgs {
  std::string axis;
  double distance = 0;  ///< [mm] or [deg]
};

void add_options(CLI::App& command, JogArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("AXIS", args.axis, "x, y, z, rx or ry")
      ->required()
      ->check(CLI::IsMember({"x", "y", "z", "rx", "ry"}));
  command
      .add_option("DISTANCE", args.distance,
                  "mm, at most 5; for rx and ry degrees, at most 1; z counts downwards")
      ->required();
}

std::string position_text(const json& joints, const char* axis) {
  const bool is_linear = axis[0] != 'r';
  const double value = joints.at(axis + std::string(is_linear ? "_m" : "_rad")).get<double>();
  char text[48];
  std::snprintf(text, sizeof text, " %s %.3f %s", axis,
                value / (is_linear ? m_per_mm : rad_per_deg), is_linear ? "mm" : "deg");
  return text;
}

std::string motion_text(const json& done) {
  std::string text = done.value("order", "") + " " + done.value("outcome", "") + ", rig " +
                     done.value("rig", "") + ", at";
  for (const char* const axis : {"x", "y", "z", "rx", "ry"})
    text += position_text(done.at("to"), axis);
  return text + "\n" + (done.contains("error") ? done.value("error", "") + "\n" : "");
}

/// `announcement`: what is about to move.
Result<int> move_rig(client::Client& daemon, const std::string& order, const json& params,
                     const std::string& announcement, Console& console) {
  console.err << "weft: " << announcement << '\n';
  constexpr std::chrono::minutes longest{10};
  const auto done = under_lease(daemon, {"weft " + order, longest}, "rig." + order, params);
  if (!done) return pass(done.error());
  print(console, motion_text(*done), *done);
  return done->value("outcome", "") == "complete" ? exit_ok : exit_failure;
}

Result<int> run_jog(client::Client& daemon, const JogArgs& args, Console& console) {
  const bool is_linear = !args.axis.starts_with('r');
  const double distance = args.distance * (is_linear ? m_per_mm : rad_per_deg);
  return move_rig(daemon, "jog", {{"axis", args.axis}, {"distance", distance}},
                  args.axis + " moves slowly; weft halt stops it", console);
}

}  // namespace

void add_rig_commands(const CommandGroup& weft) {
  add_daemon_command<SocketArgs>(
      weft, "retract", "lift the probe to the clear height, outside a run",
      [](auto& daemon, auto&, auto& console) {
        return move_rig(daemon, "retract", json::object(),
                        "z goes up to the clear height; where z has not been homed, up by at most "
                        "the clearance from where it is",
                        console);
      });
  add_daemon_command<SocketArgs>(
      weft, "park", "lift the probe, then move to the rig file's park position",
      [](auto& daemon, auto&, auto& console) {
        return move_rig(daemon, "park", json::object(),
                        "z goes up to the clear height, then x, y, rx and ry move to the park "
                        "position",
                        console);
      });
  add_daemon_command(weft, "jog", "move one axis a little, outside a run", run_jog);
}

}  // namespace weft::daemon::cli
