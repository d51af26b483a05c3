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
    std::cout
        << "The rig is in e-stop, because a latch or lock-out may have been lost. An engineer "
           "must inspect the rig and reset it.\n";
  std::cout << done->added.size() << " runs added; the next run is "
            << weft::daemon::runs::run_id(done->next_number) << std::endl;
  return 0;
}

void add_options(CLI::App& app, weft::daemon::server::DaemonOptions& options) {
  using weft::daemon::server::LogFormat;
  app.set_version_flag("--version", "weftd " + weft::daemon::software_version());
  app.add_option("--rig", options.rig, "control the rig of this file (JSON)")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--recipes", options.recipes, "read recipes from this folder")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--data", options.data, "write runs and journal to this folder")->required();
  app.add_option("--socket", options.socket, "serve clients at this Unix socket");
  app.add_option("--tokens", options.tokens, "read access tokens from this file");
  app.add_option("--port", options.port, "serve clients with a token at this TCP port");
  app.add_option("--http", options.http_port,
                 "serve the web page and HTTP clients with a token at this port");
  app.add_option("--listen", options.listen,
                 "bind both ports to this address; other machines need TLS")
      ->capture_default_str();
  app.add_option("--tls-cert", options.tls_certificate,
                 "use TLS on both ports, with this certificate and chain (PEM)");
  app.add_option("--tls-key", options.tls_key,
                 "read the private key of the certificate from this file (PEM)");
  app.add_option("--notify", options.notify,
                 "send events by webhook or MQTT, as configured in this file (JSON)")
      ->check(CLI::ExistingFile);
  app.add_option("--lab", options.lab,
                 "publish to this store: postgresql://USER@HOST/DATABASE, without password")
      ->envname("WEFT_LAB");
  app.add_option_function<long>(
         "--lab-lease",
         [&options](long seconds) { options.lab_lease = std::chrono::seconds(seconds); },
         "give a part of a campaign back this long after this daemon is gone [s]")
      ->check(CLI::Range(1, 86400));
  app.add_option("--pace", options.pace,
                 "run a simulated bench at N bench seconds per second; 0: as fast as possible")
      ->capture_default_str();
  const std::map<std::string, LogFormat> formats{
      {"text", LogFormat::text}, {"json", LogFormat::json}, {"journald", LogFormat::journald}};
  app.add_option("--log-format", options.log_format,
                 "write the journal to standard output in this format")
      ->transform(CLI::CheckedTransformer(formats).description("text|json|journald"));
}

}  // namespace

int main(int argc, char** argv) {
  weft::daemon::server::DaemonOptions options;
  options.log_format = weft::daemon::server::default_log_format();
  CLI::App app("Runs campaigns on one rig and serves clients by JSON-RPC, one object per line.",
               "weftd");
  add_options(app, options);
  bool rebuilds = false;
  app.add_flag("--rebuild-catalogue", rebuilds,
               "add the runs missing in DATA/weftd.sqlite, or replace it if damaged, then exit");
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
