// A Net F/T box at 7000 records a second, and a delayed reader: the socket buffers records, and the
// lost ones are counted.

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "daemon/hardware/link/port_link.hpp"
#include "drivers/ati_netft/netft_driver.hpp"
#include "protocols/rdt/rdt.hpp"

namespace netft_burst_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;
namespace rdt = protocols::rdt;

namespace {

/// A box with records sent by the test; a socket at a free port of this machine.
struct Box {
  Box() : descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    REQUIRE(::bind(descriptor, reinterpret_cast<sockaddr*>(&address), size) == 0);
    REQUIRE(::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  }
  ~Box() { ::close(descriptor); }
  /// The records go to the sender of this request.
  void await_request() {
    Bytes bytes(8);
    socklen_t size = sizeof host;
    REQUIRE(::recvfrom(descriptor, bytes.data(), bytes.size(), 0,
                       reinterpret_cast<sockaddr*>(&host), &size) == 8);
  }
  void send(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      Bytes bytes;
      const auto force = static_cast<std::int32_t>(++sent);
      append(bytes, rdt::Record{sent, sent, 0, {force, 0, 0}, {}});
      REQUIRE(::sendto(descriptor, bytes.data(), bytes.size(), 0,
                       reinterpret_cast<const sockaddr*>(&host), sizeof host) == 36);
    }
  }
  int descriptor;
  sockaddr_in address{}, host{};
  std::uint32_t sent = 0;
};

struct Host final : DriverHost {
  explicit Host(std::uint16_t port) : link_(open_udp(loop_, {"127.0.0.1", port}, 0).value()) {}
  Loop& loop() override { return loop_; }
  Link& link() override { return *link_; }
  void publish(const Sample& sample) override {
    ++published;
    lost += sample.lost;
    last = sample.sequence;
  }
  void identified(const DeviceIdentity&) override {}
  void state_changed(DriverState) override {}
  void fault(const Error& error) override { fault_text = to_string(error); }
  void log(LogLevel, std::string_view) override {}

  RealLoop loop_;
  std::unique_ptr<Link> link_;
  std::uint64_t published = 0, lost = 0;
  std::uint32_t last = 0;
  std::string fault_text;
};

/// A driver that streams from the box.
struct Streaming {
  Streaming() : host(ntohs(box.address.sin_port)) {
    driver =
        drivers::ati_netft_entry.create(R"({"rate_hz": 7000, "stale_after_s": 30})", host).value();
    REQUIRE(driver->open());
    box.await_request();
    box.send(1);
    run([&] { return driver->state() == DriverState::open; });
    REQUIRE(driver->arm());
    box.await_request();
    box.sent = 0;
    box.send(1);
    run([&] { return driver->state() == DriverState::armed; });
  }
  void run(const std::function<bool()>& done) {
    const TimePoint end = host.loop_.now() + 5s;
    host.loop_.run_until([&] { return done() || host.loop_.now() > end; });
    REQUIRE(done());
  }
  Box box;
  Host host;
  std::unique_ptr<Driver> driver;
};

}  // namespace

TEST_CASE("a reader held up for 50 ms at 7000 records a second loses none") {
  Streaming streaming;
  streaming.box.send(350);  // the link is not read meanwhile
  streaming.run([&] { return streaming.host.last == streaming.box.sent; });
  CHECK(streaming.host.published == streaming.box.sent);
  CHECK(streaming.host.lost == 0);
}

TEST_CASE("what a socket loses in a long stall is counted record by record") {
  Streaming streaming;
  streaming.box.send(70'000);  // ten seconds of records, more than any socket buffers
  streaming.run([&] { return streaming.host.published > 200; });
  streaming.run([&, seen = std::uint64_t{0}]() mutable {
    return std::exchange(seen, streaming.host.published) == streaming.host.published;
  });
  streaming.box.send(1);  // a gap is noticed at the next record
  streaming.run([&] { return streaming.host.last == streaming.box.sent; });
  CHECK(streaming.host.lost > 0);
  CHECK(streaming.host.published + streaming.host.lost == streaming.box.sent);
  CHECK(streaming.host.fault_text.empty());
}

}  // namespace netft_burst_test
