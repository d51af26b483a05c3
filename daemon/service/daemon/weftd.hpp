#pragma once
// The daemon: one rig, its runs, and all its clients.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "daemon/service/daemon/daemon_log.hpp"
#include "daemon/service/runs/run_manager.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::server {

struct DaemonOptions {
  std::filesystem::path rig;
  std::filesystem::path recipes;
  std::filesystem::path data;              ///< runs and journal; created if missing
  std::filesystem::path socket;            ///< default: `data`/weftd.sock
  std::filesystem::path tokens;            ///< default: `data`/tokens.json
  std::optional<std::uint16_t> port;       ///< TCP port; none: no TCP
  std::optional<std::uint16_t> http_port;  ///< HTTP port; none: no HTTP
  std::string listen = "127.0.0.1";        ///< address of both; without TLS only this machine's
  std::filesystem::path tls_certificate;   ///< PEM; if set, TCP and HTTP use TLS
  std::filesystem::path tls_key;
  double pace = 0;  ///< simulation speed of a simulated bench, as in sim.clock
  LogFormat log_format = LogFormat::text;
  std::filesystem::path notify;        ///< settings of notifications; empty: no notifications
  std::string lab;                     ///< URI of the laboratory's store; empty: none
  std::chrono::seconds lab_lease{60};  ///< of a part of a campaign
};

/// Requests from signals; set from any thread or signal handler.
struct DaemonSignals {
  const std::atomic<bool>& stop;
  std::atomic<bool>& reload;  ///< cleared by the daemon when it starts the reload
};

/// Serves until `stop`; then aborts the active run, with the probe retracted and its data kept.
/// Also writes the journal to standard output. The first line is "weftd: ready" with the ports,
/// once clients can connect. `reload`: reads certificate, key and tokens again and journals
/// "daemon.reloaded"; parts that cannot be used stay as they are. Recipes are read at each use.
/// Reports to the service manager with the protocol of sd_notify. Errors: those of the start;
/// timeout, if the run does not answer by its deadlines. Its thread is then left running, and the
/// process must end.
Status run_daemon(const DaemonOptions& options, const DaemonSignals& signals);

/// A campaign of this process, which clients may watch, hold and end meanwhile.
struct EmbeddedRun {
  runs::RunRequest request;
  std::function<runs::Checked()> check;  ///< check of its recipe, called once
  /// The campaign itself, called once, on its own thread; `hooks` carries the clients' requests.
  std::function<Result<CampaignSummary>(const CampaignHooks& hooks)> perform;
};

/// As run_daemon(), but for one run only, until it has ended. No run is stored; `data` is the
/// folder of the socket. If the daemon cannot start, returns that error and does not call
/// `perform`.
Status run_daemon_for(const DaemonOptions& options, const EmbeddedRun& own);

}  // namespace weft::daemon::server
