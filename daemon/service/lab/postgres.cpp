#include "daemon/service/lab/postgres.hpp"

#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/loop/wall_clock.hpp"

namespace weft::daemon::lab {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

void ignore_notice(void*, const char*) {}

std::string in_milliseconds(std::chrono::seconds time) {
  return std::to_string(milliseconds(time).count());
}

/// The library's message as one line, without its own label.
std::string one_line(const char* message) {
  std::string text;
  for (const char c : std::string_view(message == nullptr ? "" : message))
    text += c == '\n' || c == '\t' ? ' ' : c;
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

struct Meaning {
  std::string_view state;  ///< SQLSTATE, or the beginning of it
  Errc code;
  std::string_view hint;
};

// The first row that fits counts. Source: PostgreSQL 15 manual, appendix A.
constexpr std::array<Meaning, 17> meanings{{
    {"42501", Errc::wrong_state,
     "The administrator of the store grants roles: GRANT weft_reader, weft_submitter or weft_rig "
     "TO your login"},
    {"WL", Errc::wrong_state, ""},
    {"57014", Errc::timeout, "Repeat later, or narrow the question"},
    {"55P03", Errc::busy, "Repeat later: another session changes the same row"},
    {"40", Errc::busy, "Repeat: another session changed the same rows"},
    {"53100", Errc::no_space, "Free some space on the disk of the server"},
    {"53", Errc::busy, "Repeat later: the server has no capacity left"},
    {"P0002", Errc::not_found, ""},
    {"3F000", Errc::not_found, "An administrator installs the schema: weft lab install --lab URI"},
    {"42P01", Errc::not_found, "An administrator installs the schema: weft lab install --lab URI"},
    {"42883", Errc::unsupported, "An administrator updates the schema: weft lab install --lab URI"},
    {"0A", Errc::unsupported, ""},
    {"22", Errc::invalid_argument, ""},
    {"23", Errc::wrong_state, ""},
    {"25006", Errc::wrong_state, "The server is a read-only copy; use the address of the original"},
    {"57P", Errc::io, "The server restarts or is stopped; connect again"},
    {"08", Errc::io, "Connect again"},
}};

Meaning meaning_of(std::string_view state) {
  const auto* const found = std::ranges::find_if(
      meanings, [&](const Meaning& one) { return state.starts_with(one.state); });
  return found == meanings.end() ? Meaning{state, Errc::io, ""} : *found;
}

std::string field(const pg_result* result, int code) {
  const char* const text = PQresultErrorField(result, code);
  return text == nullptr ? "" : one_line(text);
}

/// Quoted element of an array literal.
void append_element(std::string& array, std::string_view text) {
  array += array.size() > 1 ? ",\"" : "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') array += '\\';
    array += c;
  }
  array += '"';
}

/// Settings of each session. Fixed here, so that no default of a login or database changes them.
std::string session_options(const PostgresLimits& limits) {
  return "-c statement_timeout=" + in_milliseconds(limits.statement) +
         " -c lock_timeout=" + in_milliseconds(limits.lock) +
         " -c idle_in_transaction_session_timeout=60000 -c search_path=pg_catalog"
         " -c TimeZone=UTC -c standard_conforming_strings=on -c jit=off"
         // Two finishes at once must see each other, and what was acknowledged must stay.
         " -c default_transaction_isolation=read\\ committed -c synchronous_commit=on";
}

std::string connect_hint(const std::string& reason) {
  if (reason.find("root certificate file") != std::string::npos)
    return "Give the CA of the server with sslrootcert=FILE in the URI";
  if (reason.find("certificate") != std::string::npos)
    return "Use the host name in the server's certificate, and the CA that issued it";
  if (reason.find("password") != std::string::npos)
    return "Check the line of this host, database and user in ~/.pgpass (mode 0600)";
  if (reason.find("does not support SSL") != std::string::npos)
    return "Switch TLS on at the server (ssl = on)";
  return "Check that the server runs, and its address";
}

}  // namespace

BoundText bound(std::string_view text) {
  return std::string(text);
}

BoundText bound(bool flag) {
  return flag ? "t" : "f";
}

BoundText bound(double value) {
  std::array<char, 64> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() ? BoundText(std::string(text.data(), end)) : std::nullopt;
}

BoundText bound(const std::vector<std::string>& texts) {
  std::string array = "{";
  for (const std::string& text : texts) append_element(array, text);
  return array + "}";
}

BoundText bound(const std::vector<std::int64_t>& numbers) {
  std::string array = "{";
  for (const std::int64_t number : numbers) append_element(array, std::to_string(number));
  return array + "}";
}

void Rows::Clear::operator()(pg_result* raw) const {
  PQclear(raw);
}

std::size_t Rows::size() const {
  return static_cast<std::size_t>(PQntuples(raw_.get()));
}

bool Rows::is_null(std::size_t row, int column) const {
  return PQgetisnull(raw_.get(), static_cast<int>(row), column) != 0;
}

std::string Rows::text(std::size_t row, int column) const {
  const auto bytes = PQgetlength(raw_.get(), static_cast<int>(row), column);
  return {PQgetvalue(raw_.get(), static_cast<int>(row), column), static_cast<std::size_t>(bytes)};
}

std::int64_t Rows::integer(std::size_t row, int column) const {
  const std::string digits = text(row, column);
  std::int64_t value = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return value;
}

bool Rows::flag(std::size_t row, int column) const {
  return text(row, column) == "t";
}

std::optional<std::int64_t> Rows::optional_integer(std::size_t row, int column) const {
  if (is_null(row, column)) return std::nullopt;
  return integer(row, column);
}

std::vector<std::string> Rows::texts(std::size_t row, int column) const {
  std::vector<std::string> out;
  const auto list = nlohmann::json::parse(text(row, column), nullptr, false);
  if (!list.is_array()) return out;
  for (const auto& one : list)
    if (one.is_string()) out.push_back(one.get<std::string>());
  return out;
}

void Connection::Finish::operator()(pg_conn* raw) const {
  PQfinish(raw);
}

Connection::Connection(pg_conn* raw, std::string name, const PostgresLimits& limits)
    : raw_(raw), name_(std::move(name)), limits_(limits) {}

Result<Connection> Connection::open(const LabAddress& address, std::string_view program,
                                    const PostgresLimits& limits) {
  const std::string tls(to_string(address.tls)),
      options = session_options(limits), name = "weft " + std::string(program),
      wait = std::to_string(limits.connect.count()), silence = in_milliseconds(limits.answer);
  // An empty value leaves libpq's default. gssencmode: TLS is the only encryption that is checked.
  const std::array<std::pair<const char*, const char*>, 20> settings{
      {{"host", address.host.c_str()},
       {"port", address.port.c_str()},
       {"user", address.user.c_str()},
       {"dbname", address.database.c_str()},
       {"sslmode", tls.c_str()},
       {"sslrootcert", address.ca_file.c_str()},
       {"sslcert", address.client_certificate.c_str()},
       {"sslkey", address.client_key.c_str()},
       {"sslcrl", address.crl_file.c_str()},
       {"passfile", address.password_file.c_str()},
       {"gssencmode", "disable"},
       {"connect_timeout", wait.c_str()},
       {"keepalives", "1"},
       {"keepalives_idle", "10"},
       {"keepalives_interval", "5"},
       {"keepalives_count", "3"},
       {"tcp_user_timeout", silence.c_str()},
       {"application_name", name.c_str()},
       {"client_encoding", "UTF8"},
       {"options", options.c_str()}}};
  std::vector<const char*> keywords, values;
  for (const auto& [keyword, value] : settings) {
    keywords.push_back(keyword);
    values.push_back(value);
  }
  keywords.push_back(nullptr);
  values.push_back(nullptr);
  Connection made(PQconnectdbParams(keywords.data(), values.data(), 0), address.text(), limits);
  if (!made.is_open()) {
    const std::string reason = one_line(PQerrorMessage(made.raw_.get()));
    return fail({.code = Errc::io,
                 .where = made.name_,
                 .what = "laboratory's store not reachable",
                 .got = reason,
                 .hint = connect_hint(reason)});
  }
  if (!address.is_local() && PQsslInUse(made.raw_.get()) == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = made.name_,
                 .what = "connection over TCP is not encrypted",
                 .expected = "TLS"});
  PQsetNoticeProcessor(made.raw_.get(), ignore_notice, nullptr);
  PQsetnonblocking(made.raw_.get(), 1);  // so that sending has a limit too
  return made;
}

bool Connection::is_open() const {
  return raw_ && PQstatus(raw_.get()) == CONNECTION_OK;
}

tl::unexpected<Error> Connection::fail_lost(std::string got) {
  raw_.reset();
  return fail({.code = Errc::io,
               .where = name_,
               .what = "connection to the laboratory's store lost",
               .got = std::move(got),
               .hint = "Repeat when the server is reachable"});
}

tl::unexpected<Error> Connection::fail_late() {
  raw_.reset();  // a late result must not be read as that of the next statement
  return fail({.code = Errc::timeout,
               .where = name_,
               .what = "no reply of the laboratory's store in time",
               .expected = "one within " +
                           std::to_string((limits_.statement + limits_.answer).count()) + " s",
               .hint = "Check network and server"});
}

tl::unexpected<Error> Connection::fail_result(const Rows& failed) {
  sqlstate_ = field(failed.raw(), PG_DIAG_SQLSTATE);
  const Meaning meaning = meaning_of(sqlstate_);
  const std::string hint = field(failed.raw(), PG_DIAG_MESSAGE_HINT);
  std::string what = field(failed.raw(), PG_DIAG_MESSAGE_PRIMARY);
  if (what.empty()) what = one_line(PQresultErrorMessage(failed.raw()));
  Error error{.code = meaning.code,
              .where = name_,
              .what = std::move(what),
              .got = sqlstate_.empty() ? "" : "SQLSTATE " + sqlstate_,
              .hint = hint.empty() ? std::string(meaning.hint) : hint};
  if (!is_open() || sqlstate_.starts_with("57P")) raw_.reset();
  return fail(std::move(error));
}

bool Connection::poll_until(nanoseconds deadline, bool writing) {
  pollfd wanted{.fd = PQsocket(raw_.get()), .events = POLLIN, .revents = 0};
  if (writing) wanted.events |= POLLOUT;
  while (true) {
    const nanoseconds left = deadline - steady_wall_now();
    if (left <= nanoseconds(0)) return false;
    const auto wait = std::chrono::ceil<milliseconds>(left).count();
    const int ready = ::poll(&wanted, 1, static_cast<int>(std::min<std::int64_t>(wait, 60'000)));
    if (ready > 0 || (ready < 0 && errno != EINTR)) return true;
  }
}

Result<Rows> Connection::collect() {
  const nanoseconds deadline = steady_wall_now() + limits_.statement + limits_.answer;
  for (int left = PQflush(raw_.get()); left != 0; left = PQflush(raw_.get())) {
    if (left < 0) return fail_lost(one_line(PQerrorMessage(raw_.get())));
    if (!poll_until(deadline, true)) return fail_late();
    if (PQconsumeInput(raw_.get()) == 0) return fail_lost(one_line(PQerrorMessage(raw_.get())));
  }
  Rows last(nullptr);
  bool failed = false;
  while (true) {
    while (PQisBusy(raw_.get()) != 0) {
      if (!poll_until(deadline, false)) return fail_late();
      if (PQconsumeInput(raw_.get()) == 0) break;  // the reason is in the result
    }
    Rows rows(PQgetResult(raw_.get()));
    if (rows.raw() == nullptr) break;
    if (failed) continue;
    const auto status = PQresultStatus(rows.raw());
    failed = status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK && status != PGRES_EMPTY_QUERY;
    last = std::move(rows);
  }
  if (failed) return fail_result(last);
  if (!is_open()) return fail_lost(one_line(PQerrorMessage(raw_.get())));
  return last;
}

Result<Rows> Connection::run_bound(const char* sql, const std::vector<BoundText>& values) {
  sqlstate_.clear();
  if (!is_open()) return fail_lost("");
  std::vector<const char*> texts;
  for (const BoundText& value : values) {
    if (value && value->find('\0') != std::string::npos)
      return fail({.code = Errc::invalid_argument, .where = name_, .what = "text has a NUL byte"});
    texts.push_back(value ? value->c_str() : nullptr);
  }
  if (PQsendQueryParams(raw_.get(), sql, static_cast<int>(texts.size()), nullptr, texts.data(),
                        nullptr, nullptr, 0) == 0)
    return fail_lost(one_line(PQerrorMessage(raw_.get())));
  return collect();
}

Status Connection::run_script(const std::string& sql) {
  sqlstate_.clear();
  if (!is_open()) return fail_lost("");
  if (PQsendQuery(raw_.get(), sql.c_str()) == 0)
    return fail_lost(one_line(PQerrorMessage(raw_.get())));
  if (const auto done = collect(); !done) return pass(done.error());
  return {};
}

Status Connection::transact(const std::function<Status()>& work) {
  if (const auto begun = run("BEGIN"); !begun) return pass(begun.error());
  if (Status done = work(); !done) {
    const std::string state = sqlstate_;
    if (is_open()) static_cast<void>(run("ROLLBACK"));
    sqlstate_ = state;
    return done;
  }
  if (const auto ended = run("COMMIT"); !ended) return pass(ended.error());
  return {};
}

Status Connection::listen(std::string_view channel) {
  const bool is_plain = !channel.empty() && std::ranges::all_of(channel, [](char c) {
    return (c >= 'a' && c <= 'z') || c == '_';
  });
  if (!is_plain)
    return fail({.code = Errc::invalid_argument,
                 .where = name_,
                 .what = "invalid name of a channel",
                 .expected = "letters a to z and _"});
  const std::string sql = "LISTEN " + std::string(channel);
  if (const auto done = run(sql.c_str()); !done) return pass(done.error());
  return {};
}

Result<std::optional<Notification>> Connection::wait(milliseconds longest) {
  if (!is_open()) return fail_lost("");
  const nanoseconds deadline = steady_wall_now() + longest;
  while (true) {
    if (PQconsumeInput(raw_.get()) == 0) return fail_lost(one_line(PQerrorMessage(raw_.get())));
    struct Free {
      void operator()(PGnotify* one) const { PQfreemem(one); }
    };
    if (const std::unique_ptr<PGnotify, Free> found(PQnotifies(raw_.get())); found)
      return Notification{found->relname, found->extra};
    if (!poll_until(deadline, false)) return std::optional<Notification>();
  }
}

}  // namespace weft::daemon::lab
