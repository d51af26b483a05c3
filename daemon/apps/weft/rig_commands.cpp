#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/apps/weft/daemon_call.hpp"
#include "protocols/base/time.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct ResetArgs : SocketArgs {
  std::string reason;
};
struct UnlockArgs : SocketArgs {
  std::string reason;
};
struct JogArgs : SocketArgs {
  std::string axis;
  double distance = 0;  ///< [mm] or [deg]
};

void add_options(CLI::App& command, JogArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("AXIS", args.axis, "axis to move: x, y, z, rx or ry")
      ->required()
      ->check(CLI::IsMember({"x", "y", "z", "rx", "ry"}));
  command
      .add_option("DISTANCE", args.distance,
                  "at most 5 mm, or 1 degree for rx and ry; positive z is downwards")
      ->required();
}

void add_options(CLI::App& command, ResetArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("REASON", args.reason, "reason for the journal")->required();
}
void add_options(CLI::App& command, UnlockArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("REASON", args.reason, "reason to remove the lock-out of another person");
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

/// `announcement`: the motion that is about to start.
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
                  args.axis + " moves slowly. Stop it with weft halt.", console);
}

/// Prints the state of the rig.
Result<int> print_rig(client::Client& daemon, Console& console) {
  const auto rig = call(daemon, "rig.state");
  if (!rig) return pass(rig.error());
  const std::string state = rig->value("rig", "");
  std::string text = "rig " + state;
  if (rig->value("acknowledged", false) && state != "latched")
    text += " as " + rig->value("left_by", "") + " left it. Lift the probe with weft retract";
  if (const json lock = rig->value("locked", json()); lock.is_object())
    text += ", locked out by " + lock.value("by", "") + ": " + lock.value("reason", "");
  print(console, text + "\n", *rig);
  return exit_ok;
}

/// Clears the latch, and prints the state of the rig.
Result<int> run_reset(client::Client& daemon, const ResetArgs& args, Console& console) {
  const auto reset = call(daemon, "rig.reset", {{"reason", args.reason}});
  if (!reset) return pass(reset.error());
  return print_rig(daemon, console);
}

/// Blocks motion until this person removes the lock-out.
Result<int> run_lock(client::Client& daemon, const ResetArgs& args, Console& console) {
  const auto locked = call(daemon, "rig.lock", {{"reason", args.reason}});
  if (!locked) return pass(locked.error());
  return print_rig(daemon, console);
}

Result<int> run_unlock(client::Client& daemon, const UnlockArgs& args, Console& console) {
  const auto unlocked = call(daemon, "rig.unlock", {{"reason", args.reason}});
  if (!unlocked) return pass(unlocked.error());
  return print_rig(daemon, console);
}

}  // namespace

void add_rig_commands(const CommandGroup& weft) {
  add_daemon_command(weft, "reset", run_reset);
  add_daemon_command(weft, "lock", run_lock);
  add_daemon_command(weft, "unlock", run_unlock);
  add_daemon_command<SocketArgs>(weft, "retract", [](auto& daemon, auto&, auto& console) {
    return move_rig(
        daemon, "retract", json::object(),
        "z moves up to the clear height; if z is not homed, up by at most the clearance.", console);
  });
  add_daemon_command<SocketArgs>(weft, "park", [](auto& daemon, auto&, auto& console) {
    return move_rig(daemon, "park", json::object(),
                    "z moves up to the clear height, then x, y, rx and ry to the park position.",
                    console);
  });
  add_daemon_command(weft, "jog", run_jog);
}

}  // namespace weft::daemon::cli
