// The daemon's program; see daemon/service/daemon/weftd.hpp.

#include <cstdlib>
#include <iostream>
#include <map>
#include <string>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/loop/threads.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/service/daemon/weftd.hpp"
#include "daemon/service/run_store/catalogue.hpp"

namespace {

int rebuild_catalogue(const weft::daemon::runs::CataloguePaths& paths) {
  const auto done = weft::daemon::catch_as_error(
      [&] {
        return weft::daemon::runs::rebuild_catalogue(paths, weft::daemon::utc_now().count() / 1000);
      },
      "rebuild of the catalogue");
  if (!done) {
    std::cerr << "weftd: " << weft::to_string(done.error()) << std::endl;
    return 1;
  }
  for (const auto& run : done->added) std::cout << run.id() << "  " << run.folder.string() << "\n";
  for (const auto& error : done->left_out)
    std::cerr << "weftd: left out: " << weft::to_string(error) << "\n";
  if (!done->damaged.empty())
    std::cout << "The damaged catalogue is kept as " << done->damaged.string() << "\n";
  if (done->is_latched)
    std::cout << "The rig has an emergency stop, as a latch or a lock-out may have been lost: an "
                 "engineer looks at the rig, then resets it\n";
  std::cout << done->added.size() << " runs added; the next run is "
            << weft::daemon::runs::run_id(done->next_number) << std::endl;
  return 0;
}

void add_options(CLI::App& app, weft::daemon::server::DaemonOptions& options) {
  using weft::daemon::server::LogFormat;
  app.set_version_flag("--version", "weftd " + weft::daemon::software_version());
  app.add_option("--rig", options.rig, "rig file (JSON)")->required()->check(CLI::ExistingFile);
  app.add_option("--recipes", options.recipes, "folder of recipes")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--data", options.data, "folder for runs and journal")->required();
  app.add_option("--socket", options.socket, "Unix socket, DATA/weftd.sock");
  app.add_option("--tokens", options.tokens, "file of tokens, DATA/tokens.json");
  app.add_option("--port", options.port, "TCP port, for clients with a token");
  app.add_option("--http", options.http_port,
                 "HTTP port: a page (weft page), and POST /rpc and GET /events, with a token");
  app.add_option("--listen", options.listen,
                 "address of both ports; one that other machines reach needs TLS")
      ->capture_default_str();
  app.add_option("--tls-cert", options.tls_certificate,
                 "certificate and its chain (PEM): both ports speak TLS 1.2 or 1.3");
  app.add_option("--tls-key", options.tls_key, "its key (PEM), not for everybody to read");
  app.add_option("--notify", options.notify,
                 "file (JSON) that says whom to notify by webhook or MQTT, and of which events")
      ->check(CLI::ExistingFile);
  app.add_option("--pace", options.pace,
                 "of a simulated bench: bench seconds per second, so that it can be watched; 0: as "
                 "fast as it can")
      ->capture_default_str();
  const std::map<std::string, LogFormat> formats{
      {"text", LogFormat::text}, {"json", LogFormat::json}, {"journald", LogFormat::journald}};
  app.add_option("--log-format", options.log_format,
                 "how the journal is written to standard output: text, json (an object a line) or "
                 "journald (with priorities; the default where systemd's journal reads it)")
      ->transform(CLI::CheckedTransformer(formats).description("text|json|journald"));
}

}  // namespace

int main(int argc, char** argv) {
  weft::daemon::server::DaemonOptions options;
  options.log_format = weft::daemon::server::default_log_format();
  CLI::App app("Runs campaigns on one rig; programs talk to it in JSON-RPC, one object a line.",
               "weftd");
  add_options(app, options);
  bool rebuilds = false;
  app.add_flag(
      "--rebuild-catalogue", rebuilds,
      "add the runs of DATA that DATA/weftd.sqlite does not list, then end; keep a damaged "
      "file aside and make a new one");
  weft::daemon::cli::add_generated_texts(app);
  if (const auto status = weft::daemon::cli::parse_command_line(app, argc, argv)) return *status;
  // Absolute paths: a daemon started from another folder must find the files kept of a run. The
  // socket path stays as given, because its length is limited.
  if (options.socket.empty()) options.socket = options.data / "weftd.sock";
  for (auto* const path : {&options.rig, &options.recipes, &options.data})
    *path = std::filesystem::absolute(*path);
  if (rebuilds) return rebuild_catalogue({options.data, options.rig, options.recipes});
  using weft::daemon::cli::StopSignals;
  const StopSignals signals(StopSignals::Hangup::reloads);
  const weft::Status ended = weft::daemon::server::run_daemon(
      options, {signals.requested(), StopSignals::reload_requested()});
  if (ended) return 0;
  if (options.log_format == weft::daemon::server::LogFormat::journald) std::cerr << "<3>";
  std::cerr << "weftd: " << weft::to_string(ended.error()) << std::endl;
  std::quick_exit(1);  // threads of an unresponsive run may still be working
}
