// The monitor's process beside its host: what it keeps of it, and what it says when the host is
// gone.

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/read.hpp>
#include <catch2/catch.hpp>

#include "daemon/campaign/monitor.hpp"

namespace monitor_test {

using namespace weft;
using namespace weft::daemon;
using asio::ip::tcp;

namespace {

constexpr int patience_ms = 5000;

bool hangs_up(int reading_end) {
  pollfd end{reading_end, POLLIN, 0};
  return ::poll(&end, 1, patience_ms) == 1 && (end.revents & POLLHUP) != 0;
}

RigFile one_stage_at(std::uint16_t port) {
  RigFile rig;
  DeviceEntry& stage = rig.devices.emplace_back();
  stage.driver = "thorlabs_apt";
  stage.config_json = R"({"channel": 1})";
  stage.link = TcpPort{{"127.0.0.1", port}};
  return rig;
}

}  // namespace

TEST_CASE("A monitor keeps nothing open that its host closes") {
  std::array<int, 2> line{};
  REQUIRE(::pipe(line.data()) == 0);
  const auto monitor = Monitor::start({});
  REQUIRE(monitor);
  ::close(line[1]);
  CHECK(hangs_up(line[0]));
  CHECK(::kill((*monitor)->process(), 0) == 0);  // while it lives
  ::close(line[0]);
}

TEST_CASE("A monitor sends each stage its stop when a host that owes beats is gone") {
  asio::io_context context;
  tcp::acceptor door(context, {asio::ip::make_address("127.0.0.1"), 0});
  const RigFile rig = one_stage_at(door.local_endpoint().port());
  std::array<int, 2> words{};
  REQUIRE(::pipe(words.data()) == 0);
  const pid_t host = ::fork();
  if (host == 0) {
    ::dup2(words[1], STDERR_FILENO);
    const auto monitor = Monitor::start({.stops = emergency_stops(rig, 0)});
    if (!monitor) ::_exit(1);
    (*monitor)->watch(true);
    ::_exit(0);  // without a farewell
  }
  REQUIRE(host > 0);
  int status = -1;
  ::waitpid(host, &status, 0);
  REQUIRE(status == 0);
  pollfd knock{door.native_handle(), POLLIN, 0};
  REQUIRE(::poll(&knock, 1, patience_ms) == 1);
  tcp::socket stage = door.accept();
  std::array<std::uint8_t, 7> bytes{};  // one more than the message has
  asio::error_code error;
  const std::size_t count = asio::read(stage, asio::buffer(bytes), error);
  // MGMSG_MOT_MOVE_STOP, channel 1, profiled (APT16 p. 56)
  const std::array<std::uint8_t, 6> stop{0x65, 0x04, 0x01, 0x02, 0x50, 0x01};
  CHECK(count == stop.size());
  CHECK(std::equal(stop.begin(), stop.end(), bytes.begin()));
  ::close(words[1]);
  std::array<char, 512> text{};
  const ssize_t length = ::read(words[0], text.data(), text.size() - 1);
  ::close(words[0]);
  REQUIRE(length > 0);
  CHECK(std::string(text.data()).find("process " + std::to_string(host) + " ended") !=
        std::string::npos);
}

}  // namespace monitor_test
