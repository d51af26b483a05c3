#pragma once
// How commands speak to a running weftd. For .cpp files of daemon/apps/weft.

#include <chrono>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/daemon_commands.hpp"
#include "daemon/service/client/client.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

/// A client, and whether it came by the Unix socket.
struct Reached {
  client::Client client;
  bool is_local = false;
};
/// What is typed is meant, whatever the environment says. Errors: invalid_argument, where neither
/// names a daemon or the environment names two; the token file's; Client::open()'s.
Result<Reached> reached(const SocketArgs& args);
Result<client::Client> opened(const SocketArgs& args);

/// The socket's options, and RUN.
void add_run(CLI::App& command, RunOrderArgs& args);

Result<nlohmann::json> call(client::Client& daemon, std::string_view method);
Result<nlohmann::json> call(client::Client& daemon, std::string_view method,
                            const nlohmann::json& params);

/// A run for people, with what a person is asked for.
std::string format_run(const nlohmann::json& run);
/// The run that was named, or the one under way. Errors: not_found, when none is.
Result<std::string> run_of(client::Client& daemon, const std::string& named);
/// The same run as the daemon tells it.
Result<nlohmann::json> load_run(client::Client& daemon, const std::string& named);
struct LeaseRequest {
  std::string note;                          ///< what for
  std::chrono::milliseconds longest{15000};  ///< for which others are kept away if we die meanwhile
};
/// A change after which the rig may move, under a lease of this user that no connection keeps (the
/// page's), else under one that is given back: what the daemon answers to it.
Result<nlohmann::json> under_lease(client::Client& daemon, const LeaseRequest& lease_request,
                                   std::string_view method, nlohmann::json params);
/// Asks for a change of that run, and prints it.
Result<int> ordered(const RunOrderArgs& args, std::string_view method, nlohmann::json params,
                    Console& console);

}  // namespace weft::daemon::cli
