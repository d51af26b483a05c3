// Devices on real ports as hosts see them: hosts come and go, and the plug is pulled and put in
// again.

#include "daemon/apps/weft_rig/served_link.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "daemon/apps/weft_rig/rig_server.hpp"
#include "daemon/hardware/rig/device.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace served_link_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;
using nlohmann::json;

namespace {

/// Runs the loop until `done`, or fails the test after three seconds.
void run(RealLoop& loop, const std::function<bool()>& done) {
  const TimePoint end = loop.now() + 3s;
  loop.run_until([&] { return done() || loop.now() > end; });
  REQUIRE(done());
}

/// A device that echoes received bytes.
std::unique_ptr<ServedPlace> echo(RealLoop& loop, const LinkSettings& at) {
  auto place = serve_link(loop, at, [](ByteView) { return true; });
  REQUIRE(place);
  (*place)->on_receive([to = place->get()](ByteView bytes, TimePoint) {
    const Bytes back(bytes.begin(), bytes.end());
    static_cast<void>(to->write(back));
  });
  return std::move(*place);
}

struct Host {
  Host(RealLoop& loop, const LinkSettings& at) : opened(open_link(loop, at)) {
    if (!opened) return;
    (*opened)->on_receive([this](ByteView bytes, TimePoint) {
      received.insert(received.end(), bytes.begin(), bytes.end());
    });
    (*opened)->on_closed([this](const Error& why) { closed = why; });
  }
  Result<std::unique_ptr<Link>> opened;
  Bytes received;
  std::optional<Error> closed;
};

void speaks(RealLoop& loop, const LinkSettings& at) {
  Host host(loop, at);
  REQUIRE(host.opened);
  REQUIRE((*host.opened)->write(Bytes{1, 2, 3}));
  run(loop, [&] { return host.received == Bytes{1, 2, 3}; });
}

/// A free port of this machine.
std::uint16_t free_port(RealLoop& loop) {
  return (*TcpDoor::open(loop, {"127.0.0.1", 0}, [](std::unique_ptr<Link>) {}))->port();
}

}  // namespace

TEST_CASE("an unplugged terminal hangs up, is gone, and comes back at the same path") {
  RealLoop loop;
  const test::TemporaryFolder folder;
  const std::string path = (folder / "port").string();
  const LinkSettings at = SerialSettings{.path = path};
  const auto device = echo(loop, at);
  speaks(loop, at);
  for (int round = 0; round < 2; ++round) {
    Host host(loop, at);
    REQUIRE(host.opened);
    REQUIRE(device->set_plugged(false));
    REQUIRE(device->set_plugged(false));  // out already
    run(loop, [&] { return host.closed.has_value(); });
    CHECK(host.closed->code == Errc::io);
    CHECK(host.closed->where == path);
    CHECK_FALSE((*host.opened)->write(Bytes{1}));
    CHECK(Host(loop, at).opened.error().code == Errc::not_found);
    CHECK(device->write(Bytes{1}));  // writes of an unplugged device have no effect
    REQUIRE(device->set_plugged(true));
    speaks(loop, at);
    CHECK_FALSE((*host.opened)->write(Bytes{1}));  // the old link stays closed
  }
}

namespace {

/// A host that opens the port with only open(2), and reads when the test requests it.
struct PlainHost {
  explicit PlainHost(const std::string& path)
      : port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    REQUIRE(port >= 0);
  }
  ~PlainHost() { ::close(port); }
  Bytes read() const {
    Bytes all(1 << 16);
    const ssize_t count = ::read(port, all.data(), all.size());
    all.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return all;
  }
  int port;
};

/// A device on a terminal that echoes received bytes and counts new hosts.
struct Terminal {
  Terminal() {
    device->on_host_came([this](bool) { ++hosts; });
  }
  void wait(Duration time) {
    bool later = false;
    loop.after(time, [&] { later = true; });
    run(loop, [&] { return later; });
  }
  /// Bytes received by `host` until `done`.
  template <class Done>
  Bytes received(const PlainHost& host, Done done) {
    Bytes all;
    run(loop, [&] {
      const Bytes more = host.read();
      all.insert(all.end(), more.begin(), more.end());
      return done(all);
    });
    return all;
  }

  RealLoop loop;
  const test::TemporaryFolder folder;
  const std::string path = (folder / "port").string();
  const std::unique_ptr<ServedPlace> device = echo(loop, SerialSettings{.path = path});
  int hosts = 0;
};

}  // namespace

TEST_CASE("output to a closed terminal is lost, and the next host is new") {
  Terminal at;
  for (int round = 1; round <= 3; ++round) {
    REQUIRE(at.device->write(Bytes(20, 0xEE)));
    {
      const PlainHost host(at.path);
      run(at.loop, [&] { return at.hosts == round; });
      const PlainHost other(at.path);  // a second opening is no new host
      REQUIRE(::write(host.port, "hello", 5) == 5);
      CHECK(at.received(host, [](const Bytes& b) { return b.size() >= 5; }) ==
            Bytes{'h', 'e', 'l', 'l', 'o'});
      CHECK(at.hosts == round);
      for (int i = 0; i < 2000; ++i) REQUIRE(at.device->write(Bytes(20, 0xEE)));  // left unread
    }
    at.wait(20ms);
  }
  const PlainHost last(at.path);
  REQUIRE(::write(last.port, "x", 1) == 1);  // the new host is noticed before its first byte is
                                             // received
  CHECK(at.received(last, [](const Bytes& b) { return !b.empty(); }) == Bytes{'x'});
  CHECK(at.hosts == 4);
}

TEST_CASE("a terminal that a host had for itself is free for the next, as that one set its line") {
  Terminal at;
  termios line{};
  {
    const PlainHost host(at.path);
    REQUIRE(::tcgetattr(host.port, &line) == 0);
    line.c_cc[VMIN] = 7;
    REQUIRE(::tcsetattr(host.port, TCSANOW, &line) == 0);
    REQUIRE(::ioctl(host.port, TIOCEXCL) == 0);
    run(at.loop, [&] { return at.hosts == 1; });
  }
  at.wait(20ms);
  const PlainHost host(at.path);
  REQUIRE(::tcgetattr(host.port, &line) == 0);
  CHECK(line.c_cc[VMIN] == 7);
  int exclusive = 1;
  REQUIRE(::ioctl(host.port, TIOCGEXCL, &exclusive) == 0);
  CHECK(exclusive == 0);
}

TEST_CASE("a host that does not read for long finds whole messages, the eldest") {
  Terminal at;
  const PlainHost host(at.path);
  run(at.loop, [&] { return at.hosts == 1; });
  constexpr std::size_t size = 19;  // does not divide the buffer size of any system
  unsigned reply = 0;
  const auto say = [&](int times) {
    for (int i = 0; i < times; ++i, ++reply) {
      Bytes message(size, static_cast<std::uint8_t>(reply >> 8));
      message.front() = static_cast<std::uint8_t>(reply);
      REQUIRE(at.device->write(message));
    }
  };
  const auto read_all = [&] {
    bool later = false;
    at.loop.after(50ms, [&] { later = true; });
    return at.received(host, [&](const Bytes&) { return later; });
  };
  say(5000);
  Bytes received = read_all();
  REQUIRE(received.size() < 5000 * size);
  const unsigned next = reply;
  say(10);
  const Bytes more = read_all();
  received.insert(received.end(), more.begin(), more.end());
  REQUIRE(received.size() % size == 0);
  std::vector<unsigned> numbers;
  for (std::size_t k = 0; k < received.size(); k += size) {
    const auto rest = received.begin() + static_cast<std::ptrdiff_t>(k + 1);
    REQUIRE(std::all_of(rest, rest + size - 1, [&](std::uint8_t byte) { return byte == *rest; }));
    numbers.push_back(received[k] | received[k + 1] << 8U);
  }
  REQUIRE(numbers.size() > 20);
  for (unsigned i = 0; i + 10 < numbers.size(); ++i) REQUIRE(numbers[i] == i);
  for (unsigned i = 0; i < 10; ++i) CHECK(numbers[numbers.size() - 10 + i] == next + i);
}

TEST_CASE("an unplugged TCP device resets its host, refuses others, and comes back") {
  RealLoop loop;
  const LinkSettings at = TcpPort{{"127.0.0.1", free_port(loop)}};
  const auto device = echo(loop, at);
  speaks(loop, at);
  Host host(loop, at);
  REQUIRE((*host.opened)->write(Bytes{7}));
  run(loop, [&] { return host.received == Bytes{7}; });
  REQUIRE(device->set_plugged(false));
  run(loop, [&] { return host.closed.has_value(); });
  CHECK(host.closed->got == "Connection reset by peer");
  CHECK(Host(loop, at).opened.error().code == Errc::io);
  REQUIRE(device->set_plugged(true));
  speaks(loop, at);
}

TEST_CASE("an unplugged UDP device is silent, and sends no backlog when it is back") {
  RealLoop loop;
  const LinkSettings at = UdpPort{{"127.0.0.1", free_port(loop)}};
  const auto device = echo(loop, at);
  Host host(loop, at);
  REQUIRE(device->set_plugged(false));
  REQUIRE((*host.opened)->write(Bytes{1}));
  bool later = false;
  loop.after(30ms, [&] { later = true; });
  run(loop, [&] { return later; });
  CHECK(host.received.empty());
  CHECK_FALSE(host.closed);
  REQUIRE(device->set_plugged(true));
  REQUIRE((*host.opened)->write(Bytes{2}));
  run(loop, [&] { return host.received == Bytes{2}; });
}

TEST_CASE("a UDP device sends to the configured port until a host requests") {
  RealLoop loop;
  const UdpPort at{{"127.0.0.1", free_port(loop)}, free_port(loop)};
  const auto device = echo(loop, at);
  Host host(loop, at);
  REQUIRE(device->write(Bytes{7}));
  run(loop, [&] { return host.received == Bytes{7}; });
  Host other(loop, UdpPort{at.end});
  REQUIRE((*other.opened)->write(Bytes{8}));
  run(loop, [&] { return other.received == Bytes{8}; });
  CHECK(host.received == Bytes{7});
}

TEST_CASE("a host at two places of a device is reported, and new at the last one") {
  RealLoop loop;
  const LinkSettings one = TcpPort{{"127.0.0.1", free_port(loop)}};
  const LinkSettings two = TcpPort{{"127.0.0.1", free_port(loop)}};
  std::vector<std::unique_ptr<ServedPlace>> places;
  places.push_back(serve_link(loop, one, {}).value());
  places.push_back(serve_link(loop, two, {}).value());
  const auto both = join_links(std::move(places));
  std::vector<bool> came;
  Bytes received;
  both->on_host_came([&](bool is_new) { came.push_back(is_new); });
  both->on_receive([&](ByteView bytes, TimePoint) {
    received.insert(received.end(), bytes.begin(), bytes.end());
  });
  const Host listener(loop, two);  // sends nothing
  run(loop, [&] { return came.size() == 1; });
  const Host talker(loop, one);
  run(loop, [&] { return came.size() == 2; });
  REQUIRE((*talker.opened)->write(Bytes{1}));
  run(loop, [&] { return !received.empty(); });
  const Host second_listener(loop, two);
  run(loop, [&] { return came.size() == 3; });
  const Host after_talker(loop, one);
  run(loop, [&] { return came.size() == 4; });
  CHECK(came == std::vector<bool>{false, false, false, true});
}

TEST_CASE("a device at two places is gone from both") {
  RealLoop loop;
  const test::TemporaryFolder folder;
  const LinkSettings one = SerialSettings{.path = (folder / "one").string()};
  const LinkSettings two = TcpPort{{"127.0.0.1", free_port(loop)}};
  std::vector<std::unique_ptr<ServedPlace>> places;
  places.push_back(echo(loop, one));
  places.push_back(echo(loop, two));
  const auto both = join_links(std::move(places));
  REQUIRE(both->set_plugged(false));
  CHECK_FALSE(Host(loop, one).opened);
  CHECK_FALSE(Host(loop, two).opened);
  REQUIRE(both->set_plugged(true));
  CHECK(Host(loop, one).opened);
  CHECK(Host(loop, two).opened);
}

namespace {

/// emulated17 with its ports in a folder, and a server for its rig.
struct ServedRig {
  ServedRig() {
    json rig = json::parse(test::read_file(test::source / "sim/rigs/emulated17.json"));
    rig["simulation"]["console"]["port"] = free_port(loop);
    for (json& device : rig["devices"]) {
      json& link = device["link"];
      if (link["kind"] == "serial")
        link["path"] = (folder / device["name"].get<std::string>()).string();
      else
        link["port"] = free_port(loop);
    }
    file = parse_rig_file(rig.dump()).value();
    auto made =
        RigServer::create(loop, file, test::read_file(test::source / "sim/fabrics.json"), 1);
    if (!made) FAIL(to_string(made.error()));
    server = std::move(*made);
  }
  const DeviceEntry& entry(const std::string& name) {
    for (const DeviceEntry& device : file.devices)
      if (device.name == name) return device;
    FAIL(name);
    return file.devices.front();
  }
  std::unique_ptr<Device> device(const std::string& name) {
    auto link = open_link(loop, entry(name).link);
    if (!link) FAIL(to_string(link.error()));
    auto made = Device::create(entry(name), loop, std::move(*link), file.drivers);
    REQUIRE(made);
    return std::move(*made);
  }
  void order(const std::string& text) {
    REQUIRE(server->execute_order(text).find("true") != std::string::npos);
  }

  RealLoop loop;
  const test::TemporaryFolder folder;
  RigFile file;
  std::unique_ptr<RigServer> server;
};

}  // namespace

TEST_CASE("drivers report the missing port, stay faulted, and open again at the same place") {
  ServedRig rig;
  for (const std::string name : {"stage.z", "taxels"}) {
    INFO(name);
    const auto& path = std::get<SerialSettings>(rig.entry(name).link).path;
    auto device = rig.device(name);
    REQUIRE(device->driver().open());
    run(rig.loop, [&] { return device->driver().state() == DriverState::open; });
    REQUIRE(device->driver().arm());
    run(rig.loop, [&] { return device->driver().state() == DriverState::armed; });
    rig.order(R"({"order": "fault", "fault": "unplug", "duration_s": 0.2, "device": ")" + name +
              "\"}");
    run(rig.loop, [&] { return device->driver().state() == DriverState::faulted; });
    REQUIRE(device->fault_seen());
    CHECK(device->fault_seen()->where.find(path) != std::string::npos);
    CHECK_FALSE(device->fault_seen()->hint.empty());
    CHECK_FALSE(std::filesystem::exists(path));
    run(rig.loop, [&] { return std::filesystem::exists(path); });
    CHECK(device->driver().state() == DriverState::faulted);
    device = rig.device(name);
    REQUIRE(device->driver().open());
    run(rig.loop, [&] { return device->driver().state() == DriverState::open; });
  }
}

}  // namespace served_link_test
