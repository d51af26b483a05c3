#include "daemon/cli/daemon_call.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "daemon/report/format.hpp"
#include "daemon/run/rig_file.hpp"

namespace weft::daemon::cli {

using client::Client;
using nlohmann::json;

void add_socket(CLI::App& command, SocketArgs& args) {
  command.add_option("--socket", args.socket, "the daemon's Unix socket")->envname("WEFT_SOCKET");
  command
      .add_option("--daemon", args.daemon,
                  "a daemon elsewhere, in place of the socket: tls://HOST:PORT, or "
                  "tcp://127.0.0.1:PORT; needs a token")
      ->envname("WEFT_DAEMON");
  command
      .add_option("--tls-ca", args.tls_ca,
                  "whose certificates are believed (PEM); without it the system's")
      ->envname("WEFT_TLS_CA");
  command.add_option("--token-file", args.token_file,
                     "file that holds your token; without it WEFT_TOKEN is taken");
}

namespace {

/// A token on the command line would be in everybody's list of processes.
Result<std::string> token_of(const SocketArgs& args) {
  if (args.token_file.empty()) {
    const char* const token = std::getenv("WEFT_TOKEN");
    return std::string(token == nullptr ? "" : token);
  }
  auto text = read_text_file(args.token_file);
  if (!text) return pass(text.error());
  text->erase(text->find_last_not_of(" \t\r\n") + 1);
  return text;
}

}  // namespace

Result<Client> opened(const SocketArgs& args) {
  if (args.daemon.empty() && args.socket.empty())
    return fail(Errc::invalid_argument, "which daemon?", "--socket",
                "--socket or --daemon, WEFT_SOCKET or WEFT_DAEMON");
  if (args.daemon.empty()) return Client::open(args.socket);
  const auto token = token_of(args);
  if (!token) return pass(token.error());
  return Client::open(client::Where{args.daemon, args.tls_ca, *token});
}

void add_run(CLI::App& command, RunOrderArgs& args) {
  add_socket(command, args);
  command.add_option("RUN", args.run, "its name, R-000318; the one under way where it is left out");
}

Result<json> call(Client& daemon, std::string_view method) {
  return call(daemon, method, json::object());
}

Result<json> call(Client& daemon, std::string_view method, const json& params) {
  const auto result = daemon.call(method, params.dump());
  if (!result) return pass(result.error());
  return json::parse(*result);
}

namespace {

std::string hand_over_words(const json& told) {
  const std::string state = told.value("state", "");
  if (state != "done")
    return "\n  hand-over " + state +
           (told.at("error").is_string() ? ": " + told.value("error", "") : "");
  std::string words;
  for (const json& model : told.at("models"))
    words += "\n  handed over: " + model.value("model", "") + ", accuracy " +
             percent(model.value("accuracy", 0.0), 1) + " % (" + told.value("bench", "") + ")";
  return words;
}

}  // namespace

std::string run_line(const json& run) {
  std::string line = run.value("run", "") + "  " + run.value("state", "") + "  " +
                     run.value("recipe", "") + "  " + std::to_string(run.value("trials_done", 0)) +
                     " of " + std::to_string(run.value("trials_planned", 0)) + " trials";
  if (const auto at = run.find("at"); at != run.end() && !run.contains("outcome"))
    line += "  " + at->value("fabric", "") + " " + at->value("exploration", "") + " " +
            at->value("step", "");
  if (run.contains("outcome"))
    line += "  " + run.value("outcome", "") + ", clean-up " + run.value("cleanup", "") + ", rig " +
            run.value("rig", "");
  const json attention = run.value("attention", json());
  if (attention.is_object() && attention.value("asked", false))
    line += "\n  waits for a person: " + attention.value("text", "") + "  Then: weft confirm " +
            run.value("run", "");
  if (run.contains("error")) line += "\n  " + run.value("error", "");
  if (run.contains("handover")) line += hand_over_words(run.at("handover"));
  return line + "\n";
}

/// The run that was named, or the one under way.
Result<std::string> run_of(Client& daemon, const std::string& named) {
  if (!named.empty()) return named;
  const auto rig = call(daemon, "rig.state");
  if (!rig) return pass(rig.error());
  if (rig->contains("run")) return rig->at("run").get<std::string>();
  return fail(Errc::not_found, "no run is under way", "weftd", {}, {}, "weft status lists all");
}

Result<json> run_told(Client& daemon, const std::string& named) {
  const auto id = run_of(daemon, named);
  if (!id) return pass(id.error());
  return call(daemon, "run.get", {{"run", *id}});
}

Result<json> under_lease(Client& daemon, const std::string& note, std::string_view method,
                         json params) {
  const auto lease = call(daemon, "lease.acquire", {{"note", note}});
  if (!lease) return pass(lease.error());
  params["lease"] = lease->at("lease");
  auto done = call(daemon, method, params);
  const auto released = call(daemon, "lease.release", {{"lease", lease->at("lease")}});
  if (done && !released) return pass(released.error());
  return done;
}

Result<int> ordered(const RunOrderArgs& args, std::string_view method, json params,
                    Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto id = run_of(*daemon, args.run);
  if (!id) return pass(id.error());
  params["run"] = *id;
  const auto run = call(*daemon, method, params);
  if (!run) return pass(run.error());
  print(console, run_line(*run), *run);
  return exit_ok;
}

}  // namespace weft::daemon::cli
