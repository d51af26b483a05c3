#pragma once
// Calls of commands to a running weftd. For .cpp files of daemon/apps/weft.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/service/client/client.hpp"

namespace weft::daemon::cli {

/// Address of the daemon: --socket or --daemon, else WEFT_SOCKET or WEFT_DAEMON of the environment,
/// else the socket of the systemd unit.
struct SocketArgs {
  std::filesystem::path socket;
  std::string daemon;                ///< "tls://HOST:PORT" or "tcp://127.0.0.1:PORT"
  std::filesystem::path tls_ca;      ///< --tls-ca, WEFT_TLS_CA
  std::filesystem::path token_file;  ///< one token; else the environment's WEFT_TOKEN
};
void add_options(CLI::App& command, SocketArgs& args);
/// Options of the commands that add a run to the queue.
struct RunRequestArgs : SocketArgs {
  std::string recipe;
  std::optional<std::uint64_t> seed;
  std::string name, after;
  std::int64_t repeat = 1;
  bool keep_going = false;
  ParameterArgs parameters;
};
void add_options(CLI::App& command, RunRequestArgs& args);
/// Errors: those of put_parameters().
Result<nlohmann::json> request_params(const RunRequestArgs& args);

/// Socket of the systemd unit: the default daemon of all commands.
inline constexpr const char* unit_socket = "/run/weft/weftd.sock";
/// Empty if it is not set.
std::string from_environment(const char* name);

/// A client, and whether it uses the Unix socket.
struct Reached {
  client::Client client;
  bool is_local = false;
};
/// The command line has priority over the environment. Errors: invalid_argument, if neither names a
/// daemon or the environment names two; those of the token file; those of Client::open().
Result<Reached> reached(const SocketArgs& args);

/// Adds a command on the daemon selected by its options.
template <class Args>
void add_daemon_command(const CommandGroup& group, const char* name,
                        Result<int> (*execute)(client::Client&, const Args&, Console&)) {
  group.add<Args>(name, [execute](const Args& args, Console& console) -> Result<int> {
    auto found = reached(args);
    if (!found) return pass(found.error());
    return execute(found->client, args, console);
  });
}

Result<nlohmann::json> call(client::Client& daemon, std::string_view method);
Result<nlohmann::json> call(client::Client& daemon, std::string_view method,
                            const nlohmann::json& params);

/// Text of a run, with its operator prompt.
std::string format_run(const nlohmann::json& run);
/// A run as one line that is rewritten in place: bar, trials, time left, current action.
std::string watch_line(const nlohmann::json& run);
/// Whether the change deserves a line: another state or trial, or a prompt.
bool is_news(const nlohmann::json& before, const nlohmann::json& run);
/// Text of a journal line, with its line break.
std::string format_journal_line(const nlohmann::json& line);
/// Prints a run. Errors: those of the failed call.
Result<int> print_run(const Result<nlohmann::json>& run, Console& console);

struct LeaseRequest {
  std::string note;                          ///< purpose of the lease
  std::chrono::milliseconds longest{15000};  ///< expiry of the lease if this process dies
};
/// Makes a change that may move the rig. Uses a lease of this user that no connection keeps (the
/// page's), else acquires and releases one. Returns the daemon's reply.
Result<nlohmann::json> under_lease(client::Client& daemon, const LeaseRequest& lease_request,
                                   std::string_view method, nlohmann::json params);

}  // namespace weft::daemon::cli
