#pragma once
// The daemon: one rig, its runs, and everybody who talks to it.

#include <atomic>
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
  std::filesystem::path data;              ///< runs, journal; made when missing
  std::filesystem::path socket;            ///< `data`/weftd.sock where it is empty
  std::filesystem::path tokens;            ///< `data`/tokens.json where it is empty
  std::optional<std::uint16_t> port;       ///< TCP
  std::optional<std::uint16_t> http_port;  ///< HTTP
  std::string listen = "127.0.0.1";        ///< their address; another machine's only with TLS
  std::filesystem::path tls_certificate;   ///< PEM; TCP and HTTP go through TLS then
  std::filesystem::path tls_key;
  double pace = 0;  ///< of a simulated bench, as sim.clock sets it
  LogFormat log_format = LogFormat::text;
  std::filesystem::path notify;  ///< settings of notifications; empty: nobody is called
};

/// What signals request; set from any thread or signal handler.
struct DaemonSignals {
  const std::atomic<bool>& stop;
  std::atomic<bool>& reload;  ///< taken back once it is done
};

/// Serves until `stop`; then the run under way is aborted, its probe up and its data kept. Writes
/// the journal to standard output as well, after the line "weftd: ready", which names the ports
/// once clients can connect. `reload`: certificate, key and tokens are read anew, those that cannot
/// be used stay as they are, and the journal has "daemon.reloaded"; recipes are read at each use.
/// Reports to the service manager by sd_notify's protocol. Errors: those of beginning; timeout,
/// where that run does not answer by its deadlines: its thread is left behind, and the process is
/// to end.
Status run_daemon(const DaemonOptions& options, const DaemonSignals& signals);

/// A campaign of this process, which others may look at, hold and end meanwhile.
struct EmbeddedRun {
  runs::RunRequest request;
  std::function<runs::Checked()> check;  ///< of its recipe, called once
  /// The campaign itself, called once, on a thread of its own, with what others ask for in `hooks`.
  std::function<Result<CampaignSummary>(const CampaignHooks& hooks)> perform;
};

/// As run_daemon(), for that run alone, until it has ended; nothing of it is remembered, and `data`
/// is where the socket is. Where the daemon could not be, that is the error, and nothing was
/// performed.
Status run_daemon_for(const DaemonOptions& options, const EmbeddedRun& own);

}  // namespace weft::daemon::server
