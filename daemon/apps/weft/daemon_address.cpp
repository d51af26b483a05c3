#include "daemon/apps/weft/daemon_address.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "daemon/base/file/read_file.hpp"

namespace weft::daemon::cli {
namespace {

using client::Client;

std::string from_environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// The daemon that is meant. The environment counts where the command line names none: what
/// somebody has typed is not turned elsewhere by a variable that he has forgotten.
Result<SocketArgs> meant(SocketArgs args) {
  if (!args.socket.empty() || !args.daemon.empty()) return args;
  args.socket = from_environment("WEFT_SOCKET");
  args.daemon = from_environment("WEFT_DAEMON");
  if (args.socket.empty() == args.daemon.empty())
    return fail(
        {.code = Errc::invalid_argument,
         .where = "--socket",
         .what = args.socket.empty() ? "which daemon?" : "the environment names two daemons",
         .expected = "--socket or --daemon, WEFT_SOCKET or WEFT_DAEMON",
         .got = args.socket.empty() ? "" : args.socket.string() + " and " + args.daemon});
  return args;
}

/// A token on the command line would be in everybody's list of processes.
Result<std::string> load_token(const SocketArgs& args) {
  if (args.token_file.empty()) return from_environment("WEFT_TOKEN");
  auto text = read_text_file(args.token_file);
  if (!text) return pass(text.error());
  text->erase(text->find_last_not_of(" \t\r\n") + 1);
  return text;
}

}  // namespace

void add_socket(CLI::App& command, SocketArgs& args) {
  auto* const socket =
      command.add_option("--socket", args.socket,
                         "the daemon's Unix socket; without it and --daemon, WEFT_SOCKET is taken");
  command
      .add_option("--daemon", args.daemon,
                  "a daemon elsewhere, in place of the socket: tls://HOST:PORT, or "
                  "tcp://127.0.0.1:PORT; needs a token; without it and --socket, WEFT_DAEMON is "
                  "taken")
      ->excludes(socket);
  command
      .add_option("--tls-ca", args.tls_ca,
                  "whose certificates are believed (PEM); without it the system's")
      ->envname("WEFT_TLS_CA");
  command.add_option("--token-file", args.token_file,
                     "file that holds your token; without it WEFT_TOKEN is taken");
}

Result<Reached> reached(const SocketArgs& named) {
  const auto args = meant(named);
  if (!args) return pass(args.error());
  if (args->daemon.empty()) {
    auto client = Client::open(args->socket);
    if (!client) return pass(client.error());
    return Reached{std::move(*client), true};
  }
  const auto token = load_token(*args);
  if (!token) return pass(token.error());
  auto client = Client::open(client::Where{args->daemon, args->tls_ca, *token});
  if (!client) return pass(client.error());
  return Reached{std::move(*client), false};
}

Result<Client> opened(const SocketArgs& args) {
  auto found = reached(args);
  if (!found) return pass(found.error());
  return std::move(found->client);
}

}  // namespace weft::daemon::cli
