#pragma once
// Address of a laboratory's store: postgresql://USER@HOST:PORT/DATABASE. It never holds a password.
// Source: docs/adr/0031-a-laboratory-store.md.

#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon::lab {

/// Encryption over TCP. Weaker modes of libpq are refused.
enum class TlsCheck {
  verify_full,  ///< the default: trusted CA, and the certificate is for this host
  verify_ca     ///< trusted CA, for any host
};

struct LabAddress {
  std::string host;  ///< name, IP address, or folder of a Unix socket ("/run/postgresql")
  std::string port;  ///< decimal
  std::string user;  ///< empty: that of the environment or of the process
  std::string database;
  TlsCheck tls = TlsCheck::verify_full;                  ///< without effect on a Unix socket
  std::string ca_file;                                   ///< sslrootcert; empty: libpq's default
  std::string client_certificate, client_key, crl_file;  ///< files; empty: libpq's defaults
  std::string password_file;                             ///< passfile; empty: ~/.pgpass

  /// Parses a URI. The environment sets absent parts: PGHOST, PGPORT, PGUSER, PGDATABASE,
  /// PGSSLMODE. Errors never repeat the URI, which may hold a password by mistake. Errors:
  /// parse (no such URI); invalid_argument (a password, a weak sslmode, an unsupported parameter).
  static Result<LabAddress> parse(std::string_view uri);

  /// True for a Unix socket.
  [[nodiscard]] bool is_local() const;
  /// "postgresql://ada@host:5432/lab", for messages.
  [[nodiscard]] std::string text() const;
};

/// Name of the mode in libpq: "verify-full".
std::string_view to_string(TlsCheck check);

}  // namespace weft::daemon::lab
