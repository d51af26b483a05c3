// The monitor's process beside its host: the descriptors that it keeps, and its messages when the
// host has died.

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
#include "protocols/apt/bodies.hpp"

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
  CHECK(::kill((*monitor)->process(), 0) == 0);  // the monitor is alive
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
    ::_exit(0);  // without an orderly end
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

TEST_CASE("A monitor retracts the probe at the rig's acceleration and keeps the locks meanwhile") {
  asio::io_context context;
  tcp::acceptor door(context, {asio::ip::make_address("127.0.0.1"), 0});
  RigFile rig = one_stage_at(door.local_endpoint().port());
  rig.drivers = std::make_shared<DriverCatalog>();
  rig.devices[0].role = "z";
  rig.devices[0].config_json = R"({"stage": "NRT150"})";
  rig.devices[0].acceleration_mm_s2 = 20;
  std::array<int, 2> lock{};
  REQUIRE(::pipe(lock.data()) == 0);
  const pid_t host = ::fork();
  if (host == 0) {
    const auto monitor = Monitor::start({.stops = emergency_stops(rig, 4e-3), .locks = {lock[1]}});
    if (!monitor) ::_exit(1);
    (*monitor)->plan_lift(Lift{0.0120, 0.0100});
    (*monitor)->watch(true);
    ::_exit(0);
  }
  ::close(lock[1]);
  int status = -1;
  ::waitpid(host, &status, 0);
  REQUIRE(status == 0);
  static_cast<void>(door.accept());  // the stop
  tcp::socket stage = door.accept();
  std::vector<std::uint8_t> bytes;
  asio::error_code error;
  asio::read(stage, asio::dynamic_buffer(bytes), error);
  const auto velocity = protocols::apt::decode(ByteView(bytes).first(20));
  REQUIRE(velocity);
  const auto params =
      protocols::apt::decode_body<protocols::apt::VelocityParams>(velocity->data).value();
  // 409600 counts per mm: 4506 for an acceleration of 1 mm/s2, 21987328 for a velocity of 1 mm/s.
  CHECK(params.acceleration_counts == 20 * 4506);
  CHECK(params.maximum_velocity_counts == 4 * 21987328);
  const auto move = protocols::apt::decode(ByteView(bytes).subspan(20));
  REQUIRE(move);
  CHECK(protocols::apt::decode_body<protocols::apt::ChannelCounts>(move->data)->value_counts ==
        10 * 409600);
  // 2 mm at 4 mm/s take half a second and a ramp; no program may take the stage before.
  pollfd end{lock[0], POLLIN, 0};
  CHECK(::poll(&end, 1, 500) == 0);
  CHECK(hangs_up(lock[0]));
  ::close(lock[0]);
}

TEST_CASE("A monitor that is stopped does not watch, and goes all the same") {
  auto monitor = Monitor::start({});
  REQUIRE(monitor);
  const auto lives_for = [&](int periods) {
    for (int i = 0; i < periods && (*monitor)->is_alive(); ++i) ::poll(nullptr, 0, 50);
    return (*monitor)->is_alive();
  };
  CHECK(lives_for(10));
  REQUIRE(::kill((*monitor)->process(), SIGSTOP) == 0);
  CHECK_FALSE(lives_for(200));
  monitor->reset();
}

}  // namespace monitor_test
