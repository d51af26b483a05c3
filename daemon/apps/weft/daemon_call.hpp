#pragma once
// How commands speak to a running weftd. For .cpp files of daemon/apps/weft.

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

/// Where the daemon is: --socket or --daemon; where there is neither, the environment's WEFT_SOCKET
/// or WEFT_DAEMON; where these are not set either, the unit's socket.
struct SocketArgs {
  std::filesystem::path socket;
  std::string daemon;                ///< "tls://HOST:PORT" or "tcp://127.0.0.1:PORT"
  std::filesystem::path tls_ca;      ///< --tls-ca, WEFT_TLS_CA
  std::filesystem::path token_file;  ///< one token; else the environment's WEFT_TOKEN
};
void add_options(CLI::App& command, SocketArgs& args);
/// What the commands that add a run to the queue take.
struct RunRequestArgs : SocketArgs {
  std::string recipe;
  std::optional<std::uint64_t> seed;
  std::string name, after;
  std::int64_t repeat = 1;
  bool keep_going = false;
  ParameterArgs parameters;
};
void add_options(CLI::App& command, RunRequestArgs& args);
/// Errors: put_parameters()'s.
Result<nlohmann::json> request_params(const RunRequestArgs& args);

/// Of the systemd unit: the daemon of every command that names none.
inline constexpr const char* unit_socket = "/run/weft/weftd.sock";
/// Empty where it is not set.
std::string from_environment(const char* name);

/// A client, and whether it came by the Unix socket.
struct Reached {
  client::Client client;
  bool is_local = false;
};
/// What is typed is meant, whatever the environment says. Errors: invalid_argument, where neither
/// names a daemon or the environment names two; the token file's; Client::open()'s.
Result<Reached> reached(const SocketArgs& args);

/// A command on the daemon that its options name.
template <class Args>
void add_daemon_command(const CommandGroup& group, const char* name, const char* text,
                        Result<int> (*execute)(client::Client&, const Args&, Console&)) {
  group.add<Args>(name, text, [execute](const Args& args, Console& console) -> Result<int> {
    auto found = reached(args);
    if (!found) return pass(found.error());
    return execute(found->client, args, console);
  });
}

Result<nlohmann::json> call(client::Client& daemon, std::string_view method);
Result<nlohmann::json> call(client::Client& daemon, std::string_view method,
                            const nlohmann::json& params);

/// A run for people, with what a person is asked for.
std::string format_run(const nlohmann::json& run);
/// A run as one line that is rewritten in place: bar, trials, time left, what happens.
std::string watch_line(const nlohmann::json& run);
/// Whether a reader of lines wants to know of the change: another state or trial, or a prompt.
bool is_news(const nlohmann::json& before, const nlohmann::json& run);
/// A line of the journal for people, with its line break.
std::string format_journal_line(const nlohmann::json& line);
/// Prints a run; passes on the error of a call that failed.
Result<int> print_run(const Result<nlohmann::json>& run, Console& console);

struct LeaseRequest {
  std::string note;                          ///< what for
  std::chrono::milliseconds longest{15000};  ///< for which others are kept away if we die meanwhile
};
/// A change after which the rig may move, under a lease of this user that no connection keeps (the
/// page's), else under one that is given back: what the daemon answers to it.
Result<nlohmann::json> under_lease(client::Client& daemon, const LeaseRequest& lease_request,
                                   std::string_view method, nlohmann::json params);

}  // namespace weft::daemon::cli
