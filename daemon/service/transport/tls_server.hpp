#pragma once
// What a server shows of itself under TLS: its certificate, and that it has the
// key. TLS 1.2 and 1.3.

#include <filesystem>
#include <memory>

#include "protocols/base/result.hpp"

namespace asio::ssl {
class context;
}

namespace weft::daemon::server {

class TlsServer {
 public:
  /// PEM files, the chain with the server's own certificate first. Errors:
  /// not_found; wrong_state (a key that all may read); parse (no certificate,
  /// no key, or not of one pair), with OpenSSL's words.
  static Result<std::unique_ptr<TlsServer>> load(const std::filesystem::path& certificate,
                                                 const std::filesystem::path& key);
  ~TlsServer();

  asio::ssl::context& context() { return *context_; }

 private:
  explicit TlsServer(std::unique_ptr<asio::ssl::context> context);
  std::unique_ptr<asio::ssl::context> context_;
};

}  // namespace weft::daemon::server
