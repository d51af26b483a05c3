#include "daemon/apps/weft/daemon_call.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "daemon/apps/weft/progress.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {

using client::Client;
using nlohmann::json;

Result<json> call(Client& daemon, std::string_view method) {
  return call(daemon, method, json::object());
}

Result<json> call(Client& daemon, std::string_view method, const json& params) {
  const auto result =
      daemon.call(method, params.dump(-1, ' ', false, json::error_handler_t::replace));
  if (!result) return pass(result.error());
  return json::parse(*result);
}

namespace {

std::string format_handover(const json& reply) {
  const std::string state = reply.value("state", "");
  if (state != "done")
    return "\n  handover " + state +
           (reply.value("error", json()).is_string() ? ": " + reply.value("error", "") : "");
  std::string words;
  for (const json& model : reply.value("models", json::array()))
    words += "\n  handover: " + model.value("model", "") + " (" + reply.value("bench", "") + ")";
  return words;
}

std::string format_result(const json& result) {
  std::string words;
  for (const json& one : result) {
    const json ci95 = one.value("ci95", json::array({0.0, 1.0}));
    words += "\n  accuracy of " + one.value("exploration", "") + ": " +
             percent(one.value("accuracy", 0.0), 1) +
             " % (95 %: " + percent(ci95.at(0).get<double>(), 1) + " to " +
             percent(ci95.at(1).get<double>(), 1) + ") on " +
             std::to_string(one.value("tested", 0)) + " " + one.value("unit", "") + ", " +
             one.value("protocol", "");
  }
  return words;
}

}  // namespace

std::string format_run(const json& run) {
  std::string line =
      run.value("run", "") + "  " + run.value("state", "") + "  " + run.value("recipe", "");
  if (const std::string name = run.value("name", ""); !name.empty()) line += " (" + name + ")";
  if (run.contains("trials_planned"))
    line += "  " + std::to_string(run.value("trials_done", 0)) + " of " +
            std::to_string(run.value("trials_planned", 0)) + " trials";
  if (const auto at = run.find("at"); at != run.end() && !run.contains("outcome"))
    line += "  " + at->value("fabric", "") + " " + at->value("exploration", "") + " " +
            at->value("step", "");
  if (const json left = run.value("wall_left_s", json());
      left.is_number() && left > 0 && !run.contains("outcome"))
    line += "  " + duration(left.get<double>()) + " left";
  if (run.contains("outcome"))
    line += "  " + run.value("outcome", "") + ", clean-up " + run.value("cleanup", "") + ", rig " +
            run.value("rig", "");
  const json prompt = run.value("attention", json());
  if (prompt.is_object() && prompt.value("asked", false))
    line += "\n  operator needed: " + prompt.value("text", "") + "  Then: weft confirm " +
            run.value("run", "");
  if (run.value("pause_carried_over", false))
    line += "\n  no trial is left to pause before; the queue is paused instead (weft queue start)";
  if (run.contains("error")) line += "\n  " + run.value("error", "");
  if (run.contains("dataset_error"))
    line += "\n  record not finished: " + run.value("dataset_error", "");
  if (const json since = run.value("campaign_since", json()); since.is_object())
    line += "\n  its folder now holds " + std::to_string(since.value("trials_done", 0)) + " of " +
            std::to_string(since.value("trials_planned", 0)) + " trials" +
            (since.value("complete", false) ? ", complete" : "") +
            ": the campaign was resumed outside the daemon";
  if (const json tags = run.value("tags", json::array()); !tags.empty())
    line += "\n  tags: " + joined(tags.get<std::vector<std::string>>());
  if (const std::string note = run.value("note", ""); !note.empty()) line += "\n  note: " + note;
  line += format_result(run.value("result", json::array()));
  if (run.contains("handover")) line += format_handover(run.at("handover"));
  return line + "\n";
}

std::string watch_line(const json& run) {
  constexpr std::size_t width = 24;
  const auto done = run.value("trials_done", std::size_t{0}),
             planned = run.value("trials_planned", std::size_t{0});
  const json left = run.value("wall_left_s", json()), at = run.value("at", json::object());
  std::string line = bar(done, std::max(planned, std::size_t{1}), width) + " " +
                     std::to_string(done) + "/" + std::to_string(planned) + "  ";
  line += left.is_number() ? duration(left.get<double>()) + " left" : "time left unknown";
  line += "  " + run.value("state", "") + " " + at.value("fabric", "") + " " + at.value("step", "");
  const json prompt = run.value("attention", json());
  return prompt.is_object() && prompt.value("asked", false) ? line + ": " + prompt.value("text", "")
                                                            : line;
}

bool is_news(const json& before, const json& run) {
  return std::ranges::any_of(
      std::array{"state", "trials_done", "outcome", "attention", "error"},
      [&](const char* key) { return before.value(key, json()) != run.value(key, json()); });
}

std::string format_journal_line(const json& line) {
  return utc_text(line.value("t_us", std::int64_t{0})) + "  " + line.value("run", "") + "  " +
         line.value("kind", "") + "  " + line.value("by", "") + "  " + line.at("data").dump() +
         "\n";
}

Result<int> print_run(const Result<json>& run, Console& console) {
  if (!run) return pass(run.error());
  print(console, format_run(*run), *run);
  return exit_ok;
}

namespace {

/// The lease of this user that no connection keeps, such as that of the page, which uses one
/// connection per call; null if there is none. The lease of a connected program of the same user
/// does not count.
Result<json> acquire_lease(Client& daemon) {
  const auto me = call(daemon, "session.whoami");
  if (!me) return pass(me.error());
  const auto held = call(daemon, "lease.list");
  if (!held) return pass(held.error());
  const auto there = call(daemon, "session.list");
  if (!there) return pass(there.error());
  const auto is_there = [&](const json& session) {
    return std::ranges::any_of(there->at("sessions"),
                               [&](const json& one) { return one.at("session") == session; });
  };
  for (const json& lease : held->at("leases"))
    if (lease.at("user") == me->at("user") && !is_there(lease.at("session")))
      return lease.at("lease");
  return json();
}

}  // namespace

// The lease was checked at the beginning of the change, and a lease that cannot be released
// expires. So the daemon's reply is valid in both cases.
Result<json> under_lease(Client& daemon, const LeaseRequest& lease_request, std::string_view method,
                         json params) {
  const auto lease =
      call(daemon, "lease.acquire",
           {{"note", lease_request.note}, {"ttl_ms", lease_request.longest.count()}});
  if (!lease) {
    const auto held = acquire_lease(daemon);
    if (!held) return pass(lease.error());
    const bool only_queues =
        method == "run.start" || method == "queue.add" || method == "queue.edit";
    if (!held->is_string() && !only_queues) return pass(lease.error());
    if (held->is_string()) params["lease"] = *held;
    // A run may be queued after one for which another user's lease is kept.
    auto done = call(daemon, method, params);
    return done || held->is_string() ? done : pass(lease.error());
  }
  params["lease"] = lease->at("lease");
  auto done = call(daemon, method, params);
  static_cast<void>(call(daemon, "lease.release", {{"lease", lease->at("lease")}}));
  return done;
}

std::string from_environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

namespace {

/// The selected daemon. The environment counts only if the command line names none: a forgotten
/// variable must not redirect a typed command.
Result<SocketArgs> meant(SocketArgs args) {
  if (!args.socket.empty() || !args.daemon.empty()) return args;
  args.socket = from_environment("WEFT_SOCKET");
  args.daemon = from_environment("WEFT_DAEMON");
  if (args.socket.empty() && args.daemon.empty()) args.socket = unit_socket;
  if (!args.socket.empty() && !args.daemon.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "--socket",
                 .what = "two daemons in the environment",
                 .expected = "WEFT_SOCKET or WEFT_DAEMON, not both",
                 .got = args.socket.string() + " and " + args.daemon,
                 .hint = "Unset one of them, or give --socket or --daemon"});
  return args;
}

/// Not on the command line: a token there would be visible in the list of processes.
Result<std::string> load_token(const SocketArgs& args) {
  if (args.token_file.empty()) return from_environment("WEFT_TOKEN");
  auto text = read_text_file(args.token_file);
  if (!text) return pass(text.error());
  text->erase(text->find_last_not_of(" \t\r\n") + 1);
  return text;
}

}  // namespace

void add_options(CLI::App& command, RunRequestArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RECIPE", args.recipe, "name of a recipe in the daemon's folder")->required();
  command.add_option("--seed", args.seed, "override the seed of the recipe");
  command.add_option("--name", args.name, "append this text to the name of the run's folder");
  command.add_option("--repeat", args.repeat, "queue this number of runs, each with the next seed")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command.add_option("--after", args.after, "start only after this run has ended complete");
  command.add_flag("--keep-going", args.keep_going,
                   "start the next run even if this one is stopped, aborted or fails");
  add_options(command, args.parameters);
}

Result<json> request_params(const RunRequestArgs& args) {
  json params{{"recipe", args.recipe}, {"name", args.name}};
  if (args.seed) params["seed"] = *args.seed;
  if (args.repeat != 1) params["repeat"] = args.repeat;
  if (!args.after.empty()) params["after"] = args.after;
  if (args.keep_going) params["keep_going"] = true;
  if (const Status ok = put_parameters(args.parameters, params); !ok) return pass(ok.error());
  return params;
}

void add_options(CLI::App& command, SocketArgs& args) {
  auto* const socket = command.add_option(
      "--socket", args.socket,
      "connect to this Unix socket (or WEFT_SOCKET, else " + std::string(unit_socket) + ")");
  command
      .add_option("--daemon", args.daemon,
                  "connect to tls://HOST:PORT or tcp://127.0.0.1:PORT with a token")
      ->excludes(socket);
  command.add_option("--tls-ca", args.tls_ca, "trust the CA certificates in this file (PEM)")
      ->envname("WEFT_TLS_CA");
  command.add_option("--token-file", args.token_file,
                     "read your token from this file (or set WEFT_TOKEN)");
}

Result<Reached> reached(const SocketArgs& named) {
  const auto args = meant(named);
  if (!args) return pass(args.error());
  const bool is_local = args->daemon.empty();
  const auto token = is_local ? Result<std::string>() : load_token(*args);
  if (!token) return pass(token.error());
  auto client = is_local ? Client::open(args->socket)
                         : Client::open(client::Where{args->daemon, args->tls_ca, *token});
  if (!client) return pass(client.error());
  return Reached{std::move(*client), is_local};
}

}  // namespace weft::daemon::cli
