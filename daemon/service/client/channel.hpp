#pragma once
// How a program's bytes get to a daemon and back: a Unix socket, TCP on this
// machine, or TLS.

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon::client {

/// Where a daemon is, and what to show and to ask of it.
struct Where {
  std::string at;  ///< a Unix socket's path, "tls://HOST:PORT" or "tcp://127.0.0.1:PORT"
  std::filesystem::path tls_ca;  ///< whose certificates are believed (PEM); the
                                 ///< system's where empty
  std::string token;             ///< "wft_...": not needed on a Unix socket
};

/// Blocking. One thread.
class Channel {
 public:
  virtual ~Channel() = default;
  /// All of it. Errors: io.
  virtual Status send(std::string_view bytes) = 0;
  /// What has come, waited for; 0 where the other end has closed. Errors: io.
  virtual Result<std::size_t> receive(std::span<char> into) = 0;
};

/// Errors: not_found (nobody answers there), parse (no such address),
/// wrong_state (a certificate that is not believed, or of another host),
/// timeout, and tcp:// to another machine, which would show the token to
/// everybody.
Result<std::unique_ptr<Channel>> open_channel(const Where& where);

}  // namespace weft::daemon::client
