#pragma once
// Which daemon a command speaks to, by its options or by the environment.

#include <filesystem>
#include <string>

#include "daemon/service/client/client.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

/// Where the daemon is: --socket or --daemon; where there is neither, the environment's WEFT_SOCKET
/// or WEFT_DAEMON.
struct SocketArgs {
  std::filesystem::path socket;
  std::string daemon;                ///< "tls://HOST:PORT" or "tcp://127.0.0.1:PORT"
  std::filesystem::path tls_ca;      ///< --tls-ca, WEFT_TLS_CA
  std::filesystem::path token_file;  ///< one token; else the environment's WEFT_TOKEN
};

void add_socket(CLI::App& command, SocketArgs& args);

/// A client, and whether it came by the Unix socket.
struct Reached {
  client::Client client;
  bool is_local = false;
};
/// What is typed is meant, whatever the environment says. Errors: invalid_argument, where neither
/// names a daemon or the environment names two; the token file's; Client::open()'s.
Result<Reached> reached(const SocketArgs& args);
Result<client::Client> opened(const SocketArgs& args);

}  // namespace weft::daemon::cli
