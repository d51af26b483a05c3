// The daemon's program; see daemon/server/weftd.hpp.

#include <CLI/CLI.hpp>
#include <iostream>

#include "daemon/cli/command_line.hpp"
#include "daemon/cli/manual.hpp"
#include "daemon/cli/stop_signals.hpp"
#include "daemon/server/weftd.hpp"

int main(int argc, char** argv) {
  weft::daemon::server::DaemonOptions options;
  CLI::App app("Runs campaigns on one rig; programs talk to it in JSON-RPC, one object a line.",
               "weftd");
  app.set_version_flag("--version", "weftd " WEFT_VERSION);
  app.add_option("--rig", options.rig, "rig file (JSON)")->required()->check(CLI::ExistingFile);
  app.add_option("--recipes", options.recipes, "folder of recipes")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--data", options.data, "folder for runs and journal")->required();
  app.add_option("--socket", options.socket, "Unix socket, DATA/weftd.sock");
  app.add_option("--tokens", options.tokens, "file of tokens, DATA/tokens.json");
  app.add_option("--port", options.port, "TCP port on 127.0.0.1, for clients with a token");
  app.add_option("--http", options.http_port,
                 "HTTP port on 127.0.0.1: POST /rpc and GET /events, with a token");
  app.add_flag_callback(
      "--manual",
      [&app] {
        std::cout << weft::daemon::cli::manual_page(app);
        throw CLI::Success();
      },
      "these options as a manual page");
  if (const auto status = weft::daemon::cli::parse_command_line(app, argc, argv)) return *status;
  const weft::daemon::cli::StopSignals signals;
  const auto ready = [](const weft::daemon::server::Ports& ports) {
    std::cout << "weftd: ready";
    if (ports.tcp != 0) std::cout << " on 127.0.0.1:" << ports.tcp;
    if (ports.http != 0) std::cout << ", http://127.0.0.1:" << ports.http;
    std::cout << std::endl;
  };
  const weft::Status ended = weft::daemon::server::run_daemon(options, signals.asked(), ready);
  if (ended) return 0;
  std::cerr << "weftd: " << weft::to_string(ended.error()) << std::endl;
  return 1;
}
