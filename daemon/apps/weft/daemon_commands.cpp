#include "daemon/apps/weft/daemon_commands.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/apps/weft/daemon_call.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

using client::Client;
using nlohmann::json;

/// The command by which a person takes it away; empty where none does.
std::string way_out(const json& blocker) {
  const std::string kind = blocker.value("kind", "");
  if (kind == "rig.latched" || kind == "rig.unknown") return "weft reset REASON";
  if (kind == "queue.paused") return "weft queue start";
  return {};
}

std::string blocker_text(const json& blocker) {
  const std::string way = way_out(blocker);
  return blocker.value("hint", "") + (way.empty() ? "" : " (" + way + ")") + "\n";
}

std::string ready_text(const json& ready) {
  if (ready.value("ok", false)) return "ready\n";
  std::string text = "not ready:\n";
  for (const json& blocker : ready.value("blockers", json::array()))
    text += "  " + blocker.value("where", "") + ": " + blocker.value("kind", "") + ". " +
            blocker_text(blocker);
  return text;
}

/// What keeps a run in line that could begin, where a person's word is waited for.
void print_wait(Client& daemon, const json& run, Console& console) {
  if (run.value("state", "") != "queued") return;
  const auto ready = call(daemon, "system.ready");
  if (!ready) return;  // the run is in line all the same
  for (const json& blocker : ready->value("blockers", json::array()))
    if (!way_out(blocker).empty())
      console.err << "weft: the run waits in line. " << blocker_text(blocker);
}

struct Recovered {
  std::string run, choice;
};
Result<int> print_recovered(Client& daemon, const Recovered& what, bool preview, Console& console) {
  const auto left =
      call(daemon, "run.recover", {{"run", what.run}, {"choice", what.choice}, {"preview", true}});
  if (!left) return pass(left.error());
  std::string text;
  for (const json& step : left->at("will")) text += "  " + step.get<std::string>() + "\n";
  if (preview) {
    print(console, text, *left);
    return exit_ok;
  }
  console.err << text;
  // A campaign is verified first, and its data set written: seconds for each hour of recording.
  const auto run =
      under_lease(daemon, {"weft recover " + what.run + " " + what.choice, std::chrono::minutes(2)},
                  "run.recover", {{"run", what.run}, {"choice", what.choice}});
  if (!run) return pass(run.error());
  print_wait(daemon, *run, console);
  print(console, format_run(*run), *run);
  return exit_ok;
}

Result<int> waited(Client& daemon, const json& run, Console& console) {
  const auto ended = call(daemon, "run.wait", {{"run", run.at("run")}, {"hand_over", true}});
  if (!ended) return pass(ended.error());
  print(console, format_run(*ended), *ended);
  return ended->value("outcome", "") == "complete" ? exit_ok : exit_failure;
}

std::string handover_state(const json& run) {
  return run.contains("handover") ? run.at("handover").value("state", "") : "";
}

// The fourth fact about an end, where there is one and it is not known yet. A daemon that is gone
// tells none: the hand-over goes by itself, and what is said of the run stands.
void print_handover(Client& daemon, const json& run, Console& console) {
  auto now = call(daemon, "run.get", {{"run", run.at("run")}});
  if (now && (handover_state(*now) == "waiting" || handover_state(*now) == "running"))
    now = call(daemon, "run.wait", {{"run", run.at("run")}, {"hand_over", true}});
  if (now && handover_state(*now) != handover_state(run))
    print_line(console, format_run(*now), *now);
}

}  // namespace

void add_options(CLI::App& command, StatusArgs& args) {
  add_socket(command, args);
}
void add_options(CLI::App& command, StartArgs& args) {
  add_socket(command, args);
  command.add_option("RECIPE", args.recipe, "name of a recipe in the daemon's folder")->required();
  command.add_option("--seed", args.seed, "in place of the recipe's");
  command.add_option("--name", args.name, "added to the name of the run's folder");
  command.add_flag("--wait", args.wait,
                   "until the run has ended, and what its recipe hands over with it");
}
void add_options(CLI::App& command, PauseArgs& args) {
  add_run(command, args);
  command.add_flag("--now", args.now, "not after the repetition, which is then run again");
}
void add_options(CLI::App& command, ResumeArgs& args) {
  add_run(command, args);
  command.add_flag("--preview", args.preview,
                   "an interrupted run: what it would do, nothing moves");
}
void add_options(CLI::App& command, RecoverArgs& args) {
  add_socket(command, args);
  command.add_option("RUN", args.run, "its name, R-000318")->required();
  command.add_option("CHOICE", args.choice, "resume, discard or keep-partial")
      ->required()
      ->check(CLI::IsMember({"resume", "discard", "keep-partial"}));
  command.add_flag("--preview", args.preview, "what it would do; nothing happens");
}
void add_options(CLI::App& command, ConfirmArgs& args) {
  add_run(command, args);
}
void add_options(CLI::App& command, StopArgs& args) {
  add_run(command, args);
}
void add_options(CLI::App& command, AbortArgs& args) {
  add_run(command, args);
}
void add_options(CLI::App& command, HaltArgs& args) {
  add_socket(command, args);
}
void add_options(CLI::App& command, EstopArgs& args) {
  add_socket(command, args);
}
void add_options(CLI::App& command, ResetArgs& args) {
  add_socket(command, args);
  command.add_option("REASON", args.reason, "what was looked at, in a few words")->required();
}
void add_options(CLI::App& command, WatchArgs& args) {
  add_run(command, args);
}
void add_options(CLI::App& command, LogArgs& args) {
  add_socket(command, args);
  command.add_option("RUN", args.run, "its name, R-000318; of all runs where it is left out");
  command.add_option("--most", args.most, "lines, the newest")->capture_default_str();
}
void add_options(CLI::App& command, CallArgs& args) {
  add_socket(command, args);
  command.add_option("METHOD", args.method, "noun.verb; rpc.discover lists all")->required();
  command.add_option("PARAMS", args.params, "a JSON object")->capture_default_str();
}

namespace {

/// Page by page.
Result<json> all_runs(Client& daemon) {
  json runs = json::array();
  json params = json::object();
  for (;;) {
    const auto page = call(daemon, "run.list", params);
    if (!page) return pass(page.error());
    for (const json& run : page->at("runs")) runs.push_back(run);
    const json next = page->value("next", json());
    if (next.is_null()) return runs;
    params["from"] = next;
  }
}

}  // namespace

Result<int> run_status(const StatusArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto ready = call(*daemon, "system.ready");
  if (!ready) return pass(ready.error());
  const auto runs = all_runs(*daemon);
  if (!runs) return pass(runs.error());
  std::string text = ready_text(*ready);
  for (const json& run : *runs) text += format_run(run);
  print(console, text, {{"ready", *ready}, {"runs", *runs}});
  return exit_ok;
}

Result<int> run_start(const StartArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  json params{{"recipe", args.recipe}, {"name", args.name}};
  if (args.seed) params["seed"] = *args.seed;
  const auto run =
      under_lease(*daemon, {"weft start " + args.recipe}, "run.start", std::move(params));
  if (!run) return pass(run.error());
  print_wait(*daemon, *run, console);
  if (args.wait) {
    console.err << "weft: " << format_run(*run)
                << "weft: it goes on without this command: weft watch " << run->value("run", "")
                << std::endl;
    return waited(*daemon, *run, console);
  }
  print(console, format_run(*run), *run);
  return exit_ok;
}

Result<int> run_pause(const PauseArgs& args, Console& console) {
  return ordered(args, "run.pause", {{"at", args.now ? "now" : "boundary"}}, console);
}

Result<int> run_resume(const ResumeArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto run = load_run(*daemon, args.run);
  if (!run) return pass(run.error());
  const std::string id = run->at("run").get<std::string>();
  if (run->value("state", "") != "interrupted" && !args.preview)
    return ordered(args, "run.resume", json::object(), console);
  return print_recovered(*daemon, {id, "resume"}, args.preview, console);
}

Result<int> run_recover(const RecoverArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  return print_recovered(*daemon, {args.run, args.choice}, args.preview, console);
}

Result<int> run_confirm(const ConfirmArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto run = load_run(*daemon, args.run);
  if (!run) return pass(run.error());
  const std::string id = run->at("run").get<std::string>();
  const json prompt = run->value("attention", json());
  if (!prompt.is_object() || !prompt.value("asked", false))
    return fail({.code = Errc::wrong_state,
                 .where = id,
                 .what = "the run waits for nobody",
                 .got = run->value("state", "")});
  const auto confirmed = call(*daemon, "run.confirm", {{"run", id}, {"step", prompt.at("step")}});
  if (!confirmed) return pass(confirmed.error());
  console.err << "weft: done: " << prompt.value("text", "") << '\n';
  print(console, format_run(*confirmed), *confirmed);
  return exit_ok;
}

Result<int> run_stop(const StopArgs& args, Console& console) {
  return ordered(args, "run.stop", json::object(), console);
}
Result<int> run_abort(const AbortArgs& args, Console& console) {
  return ordered(args, "run.abort", json::object(), console);
}

namespace {

Result<int> latched(const SocketArgs& args, bool emergency, Console& console) {
  auto found = reached(args);
  if (!found) return pass(found.error());
  Client& daemon = found->client;
  if (found->is_local) {
    if (Status sent = daemon.halt(emergency); !sent) return pass(sent.error());
  } else if (const auto halted = call(daemon, emergency ? "rig.estop" : "rig.halt"); !halted) {
    return pass(halted.error());  // the raw line is for the local socket
  }
  const auto rig = call(daemon, "rig.state");
  if (!rig) return pass(rig.error());
  print(console, "rig " + rig->value("rig", "") + "\n", *rig);
  return rig->value("rig", "") == "latched" ? exit_ok : exit_failure;
}

}  // namespace

Result<int> run_halt(const HaltArgs& args, Console& console) {
  return latched(args, false, console);
}
Result<int> run_estop(const EstopArgs& args, Console& console) {
  return latched(args, true, console);
}

Result<int> run_reset(const ResetArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto reset = call(*daemon, "rig.reset", {{"reason", args.reason}});
  if (!reset) return pass(reset.error());
  const auto rig = call(*daemon, "rig.state");
  if (!rig) return pass(rig.error());
  print(console, "rig " + rig->value("rig", "") + "\n", *rig);
  return exit_ok;
}

Result<int> run_watch(const WatchArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto id = run_of(*daemon, args.run);
  if (!id) return pass(id.error());
  const auto opened = call(*daemon, "sub.open", {{"topics", {"run:" + *id}}, {"mode", "latest"}});
  if (!opened) return pass(opened.error());
  json run = opened->at("snapshot").value("run:" + *id, json());
  if (run.is_null()) {
    const auto reply = load_run(*daemon, *id);  // refuses what is no run
    if (!reply) return pass(reply.error());
    run = *reply;
  }
  print_wait(*daemon, run, console);
  for (;;) {
    print_line(console, format_run(run), run);
    if (run.contains("outcome")) break;
    const auto event = daemon->next_event();
    if (!event) return pass(event.error());
    run.merge_patch(json::parse(*event).at("delta"));
  }
  print_handover(*daemon, run, console);
  return run.value("outcome", "") == "complete" ? exit_ok : exit_failure;
}

Result<int> run_log(const LogArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto log = call(*daemon, "log.tail", {{"run", args.run}, {"most", args.most}});
  if (!log) return pass(log.error());
  if (log->at("lines").empty() && !args.run.empty())
    if (const auto reply = load_run(*daemon, args.run); !reply) return pass(reply.error());
  std::string text;
  for (const json& line : log->at("lines"))
    text += utc_text(line.value("t_us", std::int64_t{0})) + "  " + line.value("run", "") + "  " +
            line.value("kind", "") + "  " + line.value("by", "") + "  " + line.at("data").dump() +
            "\n";
  print(console, text, *log);
  return exit_ok;
}

Result<int> run_call(const CallArgs& args, Console& console) {
  if (!json::accept(args.params))
    return fail({.code = Errc::parse,
                 .where = "PARAMS",
                 .what = "the parameters are no JSON",
                 .expected = "an object",
                 .got = args.params});
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto result = call(*daemon, args.method, json::parse(args.params));
  if (!result) return pass(result.error());
  print(console, result->dump(2) + "\n", *result);
  return exit_ok;
}

}  // namespace weft::daemon::cli
