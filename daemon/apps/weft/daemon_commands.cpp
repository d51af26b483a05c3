#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/daemon_call.hpp"
#include "daemon/apps/weft/progress.hpp"
#include "daemon/base/text/format.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon::cli {
namespace {

using client::Client;
using nlohmann::json;

struct StartArgs : RunRequestArgs {
  bool wait = false;
};
struct StatusArgs : SocketArgs {
  bool all = false;
  std::string state;
};
struct RunOrderArgs : SocketArgs {
  std::string run;  ///< empty: the active run
};
struct PauseArgs : RunOrderArgs {
  bool now = false;
};
/// An order that another user's lease may block.
struct BreakArgs : RunOrderArgs {
  std::string break_lease;  ///< reason for breaking that lease
};
struct ResumeArgs : BreakArgs {
  bool preview = false;
};
struct RecoverArgs : ResumeArgs {
  std::string choice;
};
struct LogArgs : RunOrderArgs {
  std::int64_t most = 100;
};
struct AnnotateArgs : SocketArgs {
  std::string run;
  std::optional<std::vector<std::string>> tags;
  std::optional<std::string> note;
};
struct CallArgs : SocketArgs {
  std::string method;
  std::string params = "{}";
};
/// The named run, or the active one. Errors: not_found, if none is active.
Result<std::string> run_of(Client& daemon, const std::string& named) {
  if (!named.empty()) return named;
  const auto rig = call(daemon, "rig.state");
  if (!rig) return pass(rig.error());
  if (rig->contains("run")) return rig->at("run").get<std::string>();
  return fail({.code = Errc::not_found,
               .where = "weftd",
               .what = "no active run",
               .hint = "Run `weft status` to list the runs"});
}

/// The state of the same run from the daemon.
Result<json> load_run(Client& daemon, const std::string& named) {
  const auto id = run_of(daemon, named);
  if (!id) return pass(id.error());
  return call(daemon, "run.get", {{"run", *id}});
}

/// Parameters of such an order.
json break_params(const BreakArgs& args) {
  return args.break_lease.empty() ? json::object() : json{{"break_lease", args.break_lease}};
}

/// Requests a change of that run and prints it.
Result<int> order(Client& daemon, const RunOrderArgs& args, std::string_view method, json params,
                  Console& console) {
  const auto id = run_of(daemon, args.run);
  if (!id) return pass(id.error());
  params["run"] = *id;
  return print_run(call(daemon, method, params), console);
}

/// The command that removes the blocker; empty if there is none.
std::string way_out(const json& blocker) {
  const std::string kind = blocker.value("kind", "");
  if (kind == "rig.latched" || kind == "rig.unknown" || kind == "rig.holding")
    return "weft reset REASON";
  if (kind == "rig.locked") return "weft unlock";
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

/// Prints the blockers of a queued run that a person must remove.
void print_wait(Client& daemon, const json& run, Console& console) {
  if (run.value("state", "") != "queued") return;
  const auto ready = call(daemon, "system.ready");
  if (!ready) return;  // the run is queued anyway
  for (const json& blocker : ready->value("blockers", json::array()))
    if (!way_out(blocker).empty())
      console.err << "weft: the run waits in the queue. " << blocker_text(blocker);
}

/// First prints the effects of the choice.
Result<int> run_recover(Client& daemon, const RecoverArgs& what, Console& console) {
  const auto left =
      call(daemon, "run.recover", {{"run", what.run}, {"choice", what.choice}, {"preview", true}});
  if (!left) return pass(left.error());
  std::string text;
  for (const json& step : left->at("will")) text += "  " + step.get<std::string>() + "\n";
  if (what.preview) {
    print(console, text, *left);
    return exit_ok;
  }
  console.err << text;
  // The campaign is verified first and its data set is written: seconds per hour of recording.
  const auto run =
      under_lease(daemon, {"weft recover " + what.run + " " + what.choice, std::chrono::minutes(2)},
                  "run.recover", {{"run", what.run}, {"choice", what.choice}});
  if (!run) return pass(run.error());
  print_wait(daemon, *run, console);
  return print_run(run, console);
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

// Prints the handover, the fourth fact about an end, once it is known. If the daemon is gone, it
// prints nothing: the handover runs on its own, and the printed run stays valid.
void print_handover(Client& daemon, const json& run, Console& console) {
  auto now = call(daemon, "run.get", {{"run", run.at("run")}});
  if (now && (handover_state(*now) == "waiting" || handover_state(*now) == "running"))
    now = call(daemon, "run.wait", {{"run", run.at("run")}, {"hand_over", true}});
  if (now && handover_state(*now) != handover_state(run))
    print_line(console, format_run(*now), *now);
}

void add_options(CLI::App& command, StartArgs& args) {
  add_options(command, static_cast<RunRequestArgs&>(args));
  command.add_flag("--wait", args.wait, "wait until the run and its handover have ended");
}
void add_options(CLI::App& command, StatusArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_flag("--all", args.all, "list all runs, not only the ten newest ended ones");
  command.add_option("--state", args.state, "list only runs in this state, such as interrupted");
}
void add_options(CLI::App& command, RunOrderArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RUN", args.run, "run, such as R-000318; the active run if omitted");
}
void add_options(CLI::App& command, PauseArgs& args) {
  add_options(command, static_cast<RunOrderArgs&>(args));
  command.add_flag("--now", args.now,
                   "pause immediately; the interrupted trial is repeated after `weft resume`");
}
void add_options(CLI::App& command, BreakArgs& args) {
  add_options(command, static_cast<RunOrderArgs&>(args));
  command.add_option("--break-lease", args.break_lease,
                     "break the lease of another user, for this reason");
}
void add_options(CLI::App& command, ResumeArgs& args) {
  add_options(command, static_cast<BreakArgs&>(args));
  command.add_flag("--preview", args.preview,
                   "list the steps that resume an ended run; nothing moves");
}
void add_options(CLI::App& command, RecoverArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RUN", args.run, "run, such as R-000318")->required();
  command.add_option("CHOICE", args.choice, "decision: resume, discard or keep-partial")
      ->required()
      ->check(CLI::IsMember({"resume", "discard", "keep-partial"}));
  command.add_flag("--preview", args.preview, "list the steps of the choice; nothing changes");
}
void add_options(CLI::App& command, AnnotateArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RUN", args.run, "run, such as R-000318")->required();
  command.add_option("--tag", args.tags, "replace the tags of the run (repeatable)");
  command.add_option("--note", args.note, "replace the note of the run");
}
void add_options(CLI::App& command, LogArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RUN", args.run, "run, such as R-000318; all runs if omitted");
  command.add_option("--most", args.most, "print at most this number of lines, the newest ones")
      ->capture_default_str();
}
void add_options(CLI::App& command, CallArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command
      .add_option("METHOD", args.method, "name of the method; `weft call rpc.discover` lists all")
      ->required();
  command.add_option("PARAMS", args.params, "parameters of the method, as a JSON object")
      ->capture_default_str();
}
/// Runs in that state, or in any, newest first: all pages, or one of them.
Result<json> newest_runs(Client& daemon, const std::string& state, bool all, std::int64_t most) {
  json runs = json::array();
  json params{{"order", "newest"}, {"most", most}};
  if (!state.empty()) params["state"] = state;
  for (;;) {
    const auto page = call(daemon, "run.list", params);
    if (!page) return pass(page.error());
    for (const json& run : page->at("runs")) runs.push_back(run);
    const json next = page->value("next", json());
    if (next.is_null() || !all) return runs;
    params["from"] = next;
  }
}

/// The ten newest ended runs; or all runs, or those in one state, if requested.
Result<json> listed_runs(Client& daemon, const StatusArgs& args) {
  constexpr std::int64_t shown = 10, most = 1000;
  if (args.all || !args.state.empty())
    return newest_runs(daemon, args.state, args.all, args.all ? most : shown);
  auto over = newest_runs(daemon, "ended", false, shown);
  if (!over) return over;
  const auto cut = newest_runs(daemon, "interrupted", false, shown);
  if (!cut) return cut;
  over->insert(over->end(), cut->begin(), cut->end());
  std::sort(over->begin(), over->end(),
            [](const json& a, const json& b) { return a.value("run", "") > b.value("run", ""); });
  if (over->size() > shown) over->erase(over->begin() + shown, over->end());
  return over;
}

/// Prints readiness, the active run and the queue, then the newest ended runs.
Result<int> run_status(Client& daemon, const StatusArgs& args, Console& console) {
  const auto ready = call(daemon, "system.ready");
  if (!ready) return pass(ready.error());
  const auto rig = call(daemon, "rig.state");
  if (!rig) return pass(rig.error());
  constexpr std::size_t most_waiting = 10;
  const auto queue = call(daemon, "queue.list", {{"most", most_waiting}});
  if (!queue) return pass(queue.error());
  const auto runs = listed_runs(daemon, args);
  if (!runs) return pass(runs.error());
  std::string text = ready_text(*ready) + "rig " + rig->value("rig", "") + "\n";
  json active;
  if (rig->contains("run")) {
    auto run = call(daemon, "run.get", {{"run", rig->at("run")}});
    if (!run) return pass(run.error());
    active = std::move(*run);
    text += "active run:\n" + format_run(active);
  }
  if (!queue->at("runs").empty()) text += "queue:\n";
  for (const json& run : queue->at("runs")) text += format_run(run);
  if (!queue->value("next", json()).is_null()) text += "more queued runs: weft queue\n";
  const bool is_chosen = args.all || !args.state.empty();
  if (!runs->empty()) text += is_chosen ? "runs:\n" : "newest ended runs (--all lists all):\n";
  for (const json& run : *runs) text += format_run(run);
  print(console, text,
        {{"ready", *ready}, {"rig", *rig}, {"active", active}, {"queue", *queue}, {"runs", *runs}});
  return exit_ok;
}

/// Acquires a lease of the rig and queues the run. With --wait, waits until it has ended and
/// returns exit_ok only if it is complete.
Result<int> run_start(Client& daemon, const StartArgs& args, Console& console) {
  auto params = request_params(args);
  if (!params) return pass(params.error());
  const auto run =
      under_lease(daemon, {"weft start " + args.recipe}, "run.start", std::move(*params));
  if (!run) return pass(run.error());
  print_wait(daemon, *run, console);
  if (args.wait) {
    console.err << "weft: " << format_run(*run)
                << "weft: Ctrl-C here does not stop the run. To follow it again: weft watch "
                << run->value("run", "") << std::endl;
    return waited(daemon, *run, console);
  }
  return print_run(run, console);
}

/// Prints the remaining trials, then resumes a held run, or an ended run that can be recovered.
Result<int> run_resume(Client& daemon, const ResumeArgs& args, Console& console) {
  const auto run = load_run(daemon, args.run);
  if (!run) return pass(run.error());
  const std::string id = run->at("run").get<std::string>();
  const std::string state = run->value("state", "");
  if (state != "interrupted" && state != "ended" && !args.preview)
    return order(daemon, args, "run.resume", break_params(args), console);
  RecoverArgs what{args, "resume"};
  what.run = id;
  return run_recover(daemon, what, console);
}

/// Prints the operator prompt, then confirms it.
Result<int> run_confirm(Client& daemon, const BreakArgs& args, Console& console) {
  const auto run = load_run(daemon, args.run);
  if (!run) return pass(run.error());
  const std::string id = run->at("run").get<std::string>();
  const json prompt = run->value("attention", json());
  if (!prompt.is_object() || !prompt.value("asked", false))
    return fail({.code = Errc::wrong_state,
                 .where = id,
                 .what = "no operator step to confirm",
                 .expected = "a run that waits for an operator",
                 .got = run->value("state", "")});
  json params = break_params(args);
  params.update({{"run", id}, {"step", prompt.at("step")}});
  const auto confirmed = call(daemon, "run.confirm", params);
  if (!confirmed) return pass(confirmed.error());
  console.err << "weft: confirmed: " << prompt.value("text", "") << '\n';
  return print_run(confirmed, console);
}

/// Prints a progress bar on a terminal, otherwise a line per trial and change of state. With --json
/// one line per event.
Result<int> run_watch(Client& daemon, const RunOrderArgs& args, Console& console) {
  const auto id = run_of(daemon, args.run);
  if (!id) return pass(id.error());
  const auto opened = call(daemon, "sub.open", {{"topics", {"run:" + *id}}, {"mode", "latest"}});
  if (!opened) return pass(opened.error());
  json run = opened->at("snapshot").value("run:" + *id, json());
  if (run.is_null()) {
    const auto reply = load_run(daemon, *id);  // fails for an unknown run
    if (!reply) return pass(reply.error());
    run = *reply;
  }
  print_wait(daemon, run, console);
  const bool has_bar = console.terminal && !console.json;
  ProgressPrinter printer(console.err, has_bar);
  for (json before = json::object();;) {
    const bool is_over = run.contains("outcome");
    if (has_bar && is_over) printer.finish();
    // The complete prompt is printed, even on a narrow terminal.
    const json prompt = run.value("attention", json());
    const bool asks = prompt.is_object() && prompt.value("asked", false);
    if (has_bar && asks && is_news(before, run)) {
      printer.finish();
      console.err << format_run(run) << std::flush;
    }
    if (has_bar && !is_over) printer.rewrite(watch_line(run));
    const bool has_lines = !has_bar || ::isatty(STDOUT_FILENO) == 0;
    if (console.json || is_over || (has_lines && is_news(before, run)))
      print_line(console, format_run(run), run);
    if (is_over) break;
    const auto event = daemon.next_event();
    if (!event) {
      printer.finish();
      return pass(event.error());
    }
    before = run;
    run.merge_patch(json::parse(*event).at("delta"));
  }
  print_handover(daemon, run, console);
  return run.value("outcome", "") == "complete" ? exit_ok : exit_failure;
}

/// Sets the given values; an empty text clears one.
Result<int> run_annotate(Client& daemon, const AnnotateArgs& args, Console& console) {
  json params{{"run", args.run}};
  if (args.tags) {
    params["tags"] = json::array();
    for (const std::string& tag : *args.tags)
      if (!tag.empty()) params["tags"].push_back(tag);
  }
  if (args.note) params["note"] = *args.note;
  return print_run(call(daemon, "run.annotate", params), console);
}

Result<int> run_log(Client& daemon, const LogArgs& args, Console& console) {
  const auto log = call(daemon, "log.tail", {{"run", args.run}, {"most", args.most}});
  if (!log) return pass(log.error());
  if (log->at("lines").empty() && !args.run.empty())
    if (const auto reply = load_run(daemon, args.run); !reply) return pass(reply.error());
  std::string text;
  for (const json& line : log->at("lines")) text += format_journal_line(line);
  print(console, text, *log);
  return exit_ok;
}

/// Calls any method and prints its result unchanged.
Result<int> run_call(const CallArgs& args, Console& console) {
  const Result<json> params = parse_json(args.params);
  if (!params) return pass(params.error(), "PARAMS");
  auto found = reached(args);
  if (!found) return pass(found.error());
  const auto result = call(found->client, args.method, *params);
  if (!result) return pass(result.error());
  print(console, result->dump(2) + "\n", *result);
  return exit_ok;
}

}  // namespace

void add_daemon_commands(const CommandGroup& weft) {
  add_daemon_command(weft, "status", run_status);
  add_daemon_command(weft, "start", run_start);
  add_daemon_command(weft, "watch", run_watch);
  add_daemon_command<PauseArgs>(weft, "pause", [](auto& daemon, auto& args, auto& console) {
    return order(daemon, args, "run.pause", {{"at", args.now ? "now" : "boundary"}}, console);
  });
  add_daemon_command(weft, "resume", run_resume);
  add_daemon_command(weft, "recover", run_recover);
  add_daemon_command(weft, "confirm", run_confirm);
  add_daemon_command<RunOrderArgs>(weft, "stop", [](auto& daemon, auto& args, auto& console) {
    return order(daemon, args, "run.stop", {}, console);
  });
  add_daemon_command<BreakArgs>(weft, "abort", [](auto& daemon, auto& args, auto& console) {
    return order(daemon, args, "run.abort", break_params(args), console);
  });
  add_daemon_command(weft, "annotate", run_annotate);
  add_daemon_command(weft, "log", run_log);
  weft.add<CallArgs>("call", run_call);
}

}  // namespace weft::daemon::cli
