// The daemon as a process: its journal on an output, its messages to the service manager, and
// refused tokens.

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/daemon/daemon_log.hpp"
#include "daemon/service/daemon/service_notifier.hpp"
#include "daemon/service/daemon/token_access.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace daemon_log_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::server;
using namespace std::chrono_literals;
using nlohmann::json;
using runs::JournalLine;
using test::TemporaryFolder;

namespace {

JournalLine line_of(std::string kind, const json& payload = json::object()) {
  return {0, 1'795'793'318'123'000, "R-000001", std::move(kind), "s-1 (ada)", payload.dump()};
}

struct Pipe {
  Pipe() { REQUIRE(::pipe(ends.data()) == 0); }
  ~Pipe() { ::close(ends[0]); }
  std::string read_all() {
    ::close(ends[1]);
    std::string out;
    std::array<char, 4096> piece{};
    for (ssize_t count = 1; count > 0;) {
      count = ::read(ends[0], piece.data(), piece.size());
      if (count > 0) out.append(piece.data(), static_cast<std::size_t>(count));
    }
    return out;
  }
  std::array<int, 2> ends{};
};

}  // namespace

TEST_CASE("a failure is an error, an abort or a halt a warning, all else is information") {
  using enum LogLevel;
  CHECK(level_of(line_of("state", {{"state", "ended"}, {"outcome", "failed"}})) == error);
  CHECK(level_of(line_of("state", {{"state", "ended"}, {"rig", "unknown"}})) == error);
  CHECK(level_of(line_of("daemon.reloaded", {{"error", "no certificate"}})) == error);
  CHECK(level_of(line_of("state", {{"state", "ended"}, {"outcome", "aborted"}})) == warning);
  CHECK(level_of(line_of("halt")) == warning);
  CHECK(level_of(line_of("token.refused", {{"count", 3}})) == warning);
  CHECK(level_of(line_of("daemon.reloaded", {{"reloaded", {"tokens"}}})) == info);
  CHECK(level_of(line_of("state", {{"state", "ended"}, {"outcome", "complete"}})) == info);
}

TEST_CASE("a line is one line in each format, whatever its names hold") {
  JournalLine line = line_of("halt", {{"reason", "smoke\n<3>forged"}});
  line.by = "token:a\nb";
  for (const LogFormat format : {LogFormat::text, LogFormat::json, LogFormat::journald})
    CHECK(format_log_line(format, line, true).find('\n') == std::string::npos);
  CHECK(format_log_line(LogFormat::journald, line, true).substr(0, 3) == "<4>");
  const json object = json::parse(format_log_line(LogFormat::json, line, false));
  CHECK(object.at("by") == line.by);
  CHECK(object.at("data").at("reason") == "smoke\n<3>forged");
  CHECK(object.at("journalled") == false);
  CHECK(object.at("time") == "2026-11-27T15:28:38.123Z");
}

TEST_CASE("the first line of the log has the addresses of the daemon, and earlier lines follow") {
  Pipe out;
  {
    DaemonLog log(LogFormat::text, out.ends[1]);
    log.write(line_of("daemon.started"), true);
    log.start(" on 127.0.0.1:7001");
  }
  const std::string text = out.read_all();
  const std::string first = "weftd: ready on 127.0.0.1:7001\n";
  REQUIRE(text.substr(0, first.size()) == first);
  CHECK(text.substr(first.size()) ==
        "2026-11-27T15:28:38.123Z info daemon.started R-000001 by s-1 (ada)\n");
}

TEST_CASE("a reader that never reads does not block writers of the log") {
  // Never closed: the log's thread writes to it until the program ends.
  static Pipe& out = *new Pipe;
  DaemonLog log(LogFormat::json, out.ends[1]);
  log.start("");
  for (int i = 0; i < 5000; ++i) log.write(line_of("state", {{"state", "running"}}), true);
  CHECK_FALSE(log.drain());
}

TEST_CASE("each line of the journal is reported once, also one that the disk refused") {
  const TemporaryFolder folder;
  std::vector<std::pair<std::string, bool>> reported;
  auto opened =
      runs::RunStore::open(folder / "weftd.sqlite", [&](const JournalLine& line, bool is_written) {
        reported.emplace_back(line.kind, is_written);
      });
  REQUIRE(opened);
  runs::RunStore store = std::move(*opened);
  store.persist({.journal = {line_of("first")}});
  const auto away = folder / "away.sqlite";
  std::filesystem::rename(folder / "weftd.sqlite", away);
  store.persist({.journal = {line_of("second")}});
  CHECK_FALSE(store.append_journal(0, "", "refused", "ada"));
  std::filesystem::rename(away, folder / "weftd.sqlite");
  store.persist({});
  CHECK(store.is_persisted());
  using Reported = std::vector<std::pair<std::string, bool>>;
  CHECK(reported == Reported{{"first", true}, {"second", false}});
}

TEST_CASE("a service manager receives ready, alive, status and the time that an end may take") {
  const TemporaryFolder folder;
  const std::string path = (folder / "notify").string();
  const int manager = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, path.size());
  REQUIRE(::bind(manager, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  const auto received = [manager] {
    std::array<char, 512> text{};
    const ssize_t count = ::recv(manager, text.data(), text.size(), 0);
    return count < 0 ? std::string() : std::string(text.data(), static_cast<std::size_t>(count));
  };
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  ::setenv("WATCHDOG_USEC", "4000000", 1);
  ServiceNotifier notifier;
  ::unsetenv("NOTIFY_SOCKET");
  ::unsetenv("WATCHDOG_USEC");
  notifier.ready();
  CHECK(received() == "READY=1\n");
  notifier.reloading(7s);
  CHECK(received() == "RELOADING=1\nMONOTONIC_USEC=7000000\n");
  const auto status = [] { return std::string("rig safe"); };
  notifier.tick(10s, status);
  CHECK(received() == "WATCHDOG=1\n");
  CHECK(received() == "STATUS=rig safe\n");
  notifier.tick(11900ms, status);
  CHECK(received().empty());
  notifier.tick(12s, status);
  CHECK(received() == "WATCHDOG=1\n");
  notifier.stopping(20s, 140s);
  CHECK(received() == "STOPPING=1\nEXTEND_TIMEOUT_USEC=135000000\n");
  notifier.stopping(20500ms, 140s);
  CHECK(received().empty());
  notifier.stopping(21s, Clock::max());
  CHECK(received() == "STOPPING=1\nEXTEND_TIMEOUT_USEC=15000000\n");
  ::close(manager);
}

TEST_CASE("refused tokens are journalled once a window for each address, and none is lost") {
  const TemporaryFolder folder;
  std::vector<std::pair<std::string, std::size_t>> journal;
  TokenAccess tokens(std::move(access::TokenKeeper::open(folder / "tokens.json").value()),
                     [&](std::string_view kind, const json& payload) {
                       REQUIRE(kind == "token.refused");
                       journal.emplace_back(payload.at("address"), payload.at("count"));
                     });
  using Journal = std::vector<std::pair<std::string, std::size_t>>;
  for (int i = 0; i < 1000; ++i) tokens.on_refused("192.0.2.7", 0s);
  CHECK(journal == Journal{{"192.0.2.7", 1}});
  tokens.tick(10s);
  CHECK(journal.back() == std::pair<std::string, std::size_t>{"192.0.2.7", 999});
  tokens.on_refused("192.0.2.7", 11s);  // of the next window
  CHECK(journal.size() == 2);
  tokens.close();
  CHECK(journal.size() == 3);
  journal.clear();
  for (int i = 0; i < 1000; ++i) tokens.on_refused("2001:db8::" + std::to_string(i), 30s);
  CHECK(journal.size() == runs::RepeatedStops::most_apart);
  tokens.tick(40s);
  CHECK(journal.size() == runs::RepeatedStops::most_apart + 1);
  CHECK(journal.back().second == 1000 - runs::RepeatedStops::most_apart);
}

TEST_CASE("an address is limited by its own refusals, until their window is over") {
  access::RefusedTokens refused;
  for (std::size_t i = 0; i < access::RefusedTokens::most_in_window; ++i) {
    CHECK_FALSE(refused.is_limited("192.0.2.7", 1s));
    refused.add("192.0.2.7", 1s);
  }
  CHECK(refused.is_limited("192.0.2.7", 1s));
  CHECK_FALSE(refused.is_limited("192.0.2.8", 1s));
  CHECK(refused.is_limited("192.0.2.7", 10900ms));
  CHECK_FALSE(refused.is_limited("192.0.2.7", 11s));
}

}  // namespace daemon_log_test
