#pragma once
// The few libpq calls that the laboratory's store needs, with errors as values. Values are always
// bound, never pasted into SQL. No call waits without a limit.

#include <chrono>
#include <concepts>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/lab/lab_address.hpp"
#include "protocols/base/result.hpp"

struct pg_conn;
struct pg_result;

namespace weft::daemon::lab {

/// A value in PostgreSQL's text form; nullopt is NULL.
using BoundText = std::optional<std::string>;

BoundText bound(std::string_view text);
BoundText bound(bool flag);
BoundText bound(double value);
/// An array of text: {"a","b"}.
BoundText bound(const std::vector<std::string>& texts);
BoundText bound(const std::vector<std::int64_t>& numbers);
inline BoundText bound(const std::string& text) {
  return text;
}
inline BoundText bound(const char* text) {
  return std::string(text);
}
template <std::integral Int>
BoundText bound(Int value) {
  return std::to_string(value);
}
template <class Value>
BoundText bound(const std::optional<Value>& value) {
  return value ? bound(*value) : std::nullopt;
}

/// Rows of one statement. Row and column count from 0.
class Rows {
 public:
  explicit Rows(pg_result* raw) : raw_(raw) {}

  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] bool is_null(std::size_t row, int column) const;
  [[nodiscard]] std::string text(std::size_t row, int column) const;  ///< empty for NULL
  [[nodiscard]] std::int64_t integer(std::size_t row, int column) const;
  [[nodiscard]] bool flag(std::size_t row, int column) const;
  /// Empty for NULL.
  [[nodiscard]] std::optional<std::int64_t> optional_integer(std::size_t row, int column) const;
  /// An array of text, selected with to_json().
  [[nodiscard]] std::vector<std::string> texts(std::size_t row, int column) const;
  [[nodiscard]] pg_result* raw() const { return raw_.get(); }

 private:
  struct Clear {
    void operator()(pg_result* raw) const;
  };
  std::unique_ptr<pg_result, Clear> raw_;
};

struct Notification {
  std::string channel, payload;
};

/// Time limits of a connection.
struct PostgresLimits {
  std::chrono::seconds connect{5};  ///< for each address of the host
  std::chrono::seconds statement{15};
  std::chrono::seconds lock{5};    ///< of a wait for a row or table
  std::chrono::seconds answer{5};  ///< beyond `statement`: the network or the server is gone
};

/// One session. Thread: one at a time. Errors of all calls: io, unreachable or connection lost
/// (then is_open() is false); timeout; busy, a lock was not free in time; no_space; wrong_state, no
/// permission (SQLSTATE 42501) or a conflict with stored data; not_found; invalid_argument;
/// unsupported. No message has a password.
class Connection {
 public:
  /// `program`: part of application_name ("weft PROGRAM"), for the server's list of sessions.
  /// Errors also: invalid_argument, TCP without TLS.
  static Result<Connection> open(const LabAddress& address, std::string_view program,
                                 const PostgresLimits& limits = {});

  /// Runs one statement with its values as $1, $2, ...
  template <class... Values>
  Result<Rows> run(const char* sql, const Values&... values) {
    return run_bound(sql, std::vector<BoundText>{bound(values)...});
  }
  Result<Rows> run_bound(const char* sql, const std::vector<BoundText>& values);
  /// Runs the statements of a trusted text without values, such as a migration.
  Status run_script(const std::string& sql);
  /// Runs `work` in one transaction; an error of `work` undoes all of it.
  Status transact(const std::function<Status()>& work);

  /// Receives notifications on `channel`, a plain identifier.
  Status listen(std::string_view channel);
  /// The next notification; nothing if none came within `longest`.
  Result<std::optional<Notification>> wait(std::chrono::milliseconds longest);

  /// False after a lost connection; every call then fails with io.
  [[nodiscard]] bool is_open() const;
  /// Five characters of the last error from the server; empty if it had none.
  [[nodiscard]] const std::string& sqlstate() const { return sqlstate_; }

 private:
  struct Finish {
    void operator()(pg_conn* raw) const;
  };
  Connection(pg_conn* raw, std::string name, const PostgresLimits& limits);
  /// Waits for all results; returns the last one.
  Result<Rows> collect();
  /// Waits until the socket is readable, or also writable. `deadline`: of steady_wall_now(). False:
  /// it passed.
  bool poll_until(std::chrono::nanoseconds deadline, bool writing);
  tl::unexpected<Error> fail_result(const Rows& failed);
  tl::unexpected<Error> fail_lost(std::string got);
  tl::unexpected<Error> fail_late();

  std::unique_ptr<pg_conn, Finish> raw_;
  std::string name_;  ///< LabAddress::text(), for messages
  PostgresLimits limits_;
  std::string sqlstate_;
};

}  // namespace weft::daemon::lab
