#include "daemon/service/lab/lab_address.hpp"

#include <libpq-fe.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <utility>

namespace weft::daemon::lab {
namespace {

constexpr const char* form = "postgresql://USER@HOST:PORT/DATABASE";

/// The message never has a part of the URI: a mistyped URI may have its password anywhere.
tl::unexpected<Error> refuse(Errc code, std::string what, std::string expected = {},
                             std::string hint = {}) {
  return fail({.code = code,
               .where = "laboratory's store",
               .what = std::move(what),
               .expected = std::move(expected),
               .hint = std::move(hint)});
}

std::string from_environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};
using Options = std::unique_ptr<PQconninfoOption, FreeOptions>;

/// Where a parameter of the URI is stored; null: not supported.
std::string* place_of(LabAddress& address, std::string& mode, std::string_view keyword) {
  const std::array<std::pair<std::string_view, std::string*>, 10> places{
      {{"host", &address.host},
       {"port", &address.port},
       {"user", &address.user},
       {"dbname", &address.database},
       {"sslmode", &mode},
       {"sslrootcert", &address.ca_file},
       {"sslcert", &address.client_certificate},
       {"sslkey", &address.client_key},
       {"sslcrl", &address.crl_file},
       {"passfile", &address.password_file}}};
  const auto* const found =
      std::ranges::find(places, keyword, [](auto& pair) { return pair.first; });
  return found == places.end() ? nullptr : found->second;
}

Result<TlsCheck> read_tls(const std::string& stated, bool is_local) {
  const bool from_uri = !stated.empty();
  const std::string mode = from_uri ? stated : from_environment("PGSSLMODE");
  if (mode.empty() || mode == "verify-full") return TlsCheck::verify_full;
  if (mode == "verify-ca") return TlsCheck::verify_ca;
  if (is_local && !from_uri) return TlsCheck::verify_full;
  return fail({.code = Errc::invalid_argument,
               .where = from_uri ? "laboratory's store" : "PGSSLMODE",
               .what = "sslmode does not verify the server",
               .expected = "verify-full or verify-ca",
               .got = mode.substr(0, 20),
               .hint = "Give the CA of the server with sslrootcert=FILE"});
}

/// The system's name of this user, which libpq uses too.
std::string system_user() {
  std::array<char, 4096> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  const int failed = getpwuid_r(geteuid(), &entry, buffer.data(), buffer.size(), &found);
  return failed != 0 || found == nullptr ? "" : entry.pw_name;
}

void add_environment(LabAddress& address) {
  if (address.host.empty()) address.host = from_environment("PGHOST");
  if (address.host.empty()) address.host = "/var/run/postgresql";
  if (address.port.empty()) address.port = from_environment("PGPORT");
  if (address.port.empty()) address.port = "5432";
  if (address.user.empty()) address.user = from_environment("PGUSER");
  if (address.user.empty()) address.user = system_user();
  if (address.database.empty()) address.database = from_environment("PGDATABASE");
  if (address.database.empty()) address.database = address.user;
}

bool is_port(std::string_view text) {
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

}  // namespace

std::string_view to_string(TlsCheck check) {
  return check == TlsCheck::verify_full ? "verify-full" : "verify-ca";
}

bool LabAddress::is_local() const {
  return host.starts_with('/');
}

std::string LabAddress::text() const {
  const std::string before = "postgresql://" + user + (user.empty() ? "" : "@");
  if (is_local()) return before + "/" + database + "?host=" + host + "&port=" + port;
  const bool is_v6 = host.find(':') != std::string::npos;
  return before + (is_v6 ? "[" + host + "]" : host) + ":" + port + "/" + database;
}

Result<LabAddress> LabAddress::parse(std::string_view uri) {
  if (!uri.starts_with("postgresql://") && !uri.starts_with("postgres://"))
    return refuse(Errc::parse, "address is no URI of PostgreSQL", form);
  char* reason = nullptr;
  const Options options(PQconninfoParse(std::string(uri).c_str(), &reason));
  PQfreemem(reason);  // has parts of the URI
  if (!options) return refuse(Errc::parse, "URI of PostgreSQL not readable", form);
  LabAddress address;
  std::string mode;
  for (const PQconninfoOption* each = options.get(); each->keyword != nullptr; ++each) {
    if (each->val == nullptr) continue;
    const std::string_view keyword = each->keyword;
    if (keyword == "password" || keyword == "sslpassword")
      return refuse(
          Errc::invalid_argument, "URI has a password", "a URI without password",
          "Put it into ~/.pgpass (mode 0600) or the file of PGPASSFILE: a command line is "
          "visible in the list of processes");
    std::string* const place = place_of(address, mode, keyword);
    if (place == nullptr)
      return refuse(Errc::invalid_argument,
                    "parameter of the URI not supported: " + std::string(keyword),
                    "host, port, user, dbname, sslmode, sslrootcert, sslcert, sslkey, sslcrl or "
                    "passfile");
    *place = each->val;
  }
  add_environment(address);
  if (!is_port(address.port))
    return refuse(Errc::invalid_argument, "port is no number", "1 to 65535",
                  "Write special characters of names as %XX");
  if (address.host.find_first_of(",@ ") != std::string::npos)
    return refuse(Errc::invalid_argument, "host is no name of one host", "one host");
  if (address.database.find('@') != std::string::npos)
    return refuse(Errc::invalid_argument, "database's name has an @", form,
                  "A password does not belong into the URI: use ~/.pgpass");
  auto tls = read_tls(mode, address.is_local());
  if (!tls) return pass(tls.error());
  address.tls = *tls;
  return address;
}

}  // namespace weft::daemon::lab
