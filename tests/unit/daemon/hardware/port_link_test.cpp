#include "daemon/hardware/link/port_link.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <thread>

#include "daemon/hardware/link/descriptor_link.hpp"
#include "daemon/hardware/link/serial_line.hpp"

namespace port_link_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;

namespace {

/// A pseudo-terminal: the test holds the master, the link opens the path.
struct Terminal {
  Terminal() : master(::posix_openpt(O_RDWR | O_NOCTTY)) {
    REQUIRE(master >= 0);
    REQUIRE(::grantpt(master) == 0);
    REQUIRE(::unlockpt(master) == 0);
    path = ::ptsname(master);
  }
  ~Terminal() { hang_up(); }
  void hang_up() {
    if (master >= 0) ::close(master);
    master = -1;
  }
  int master;
  std::string path;
};

/// A server's end on a free port of this machine.
struct Server {
  explicit Server(int type) : descriptor(::socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::bind(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    if (type == SOCK_STREAM) REQUIRE(::listen(descriptor, 1) == 0);
    socklen_t size = sizeof address;
    REQUIRE(::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0);
    port = ntohs(address.sin_port);
  }
  ~Server() { ::close(descriptor); }
  [[nodiscard]] Endpoint end() const { return {"127.0.0.1", port}; }
  int descriptor;
  std::uint16_t port = 0;
};

Bytes every_byte() {
  Bytes bytes;
  for (int i = 0; i < 256; ++i) bytes.push_back(static_cast<std::uint8_t>(i));
  return bytes;
}

/// Runs the loop until `done`, or fails the test after two seconds.
void run(RealLoop& loop, const std::function<bool()>& done) {
  const TimePoint end = loop.now() + 2s;
  loop.run_until([&] { return done() || loop.now() > end; });
  REQUIRE(done());
}

void collect(Link& link, Bytes& into) {
  link.on_receive([&](ByteView b, TimePoint) { into.insert(into.end(), b.begin(), b.end()); });
}

}  // namespace

TEST_CASE("all 256 bytes cross a pseudo-terminal unchanged, both ways") {
  RealLoop loop;
  const Terminal terminal;
  auto link = open_serial(loop, {.path = terminal.path, .rts_cts = true});
  REQUIRE(link);
  Bytes got;
  collect(**link, got);
  const Bytes sent = every_byte();
  REQUIRE(::write(terminal.master, sent.data(), sent.size()) == 256);
  run(loop, [&] { return got.size() == 256; });
  CHECK(got == sent);

  REQUIRE((*link)->write(sent));
  Bytes back(256);
  REQUIRE(::read(terminal.master, back.data(), back.size()) == 256);
  CHECK(back == sent);
}

TEST_CASE("bytes are stamped when they arrive, not when they are read") {
  RealLoop loop;
  const Terminal terminal;
  auto link = open_serial(loop, {.path = terminal.path});
  REQUIRE(link);
  TimePoint sent_at{}, stamp{};
  (*link)->on_receive([&](ByteView, TimePoint at) { stamp = at; });
  loop.after(2ms, [&] {
    sent_at = loop.now();
    REQUIRE(::write(terminal.master, "x", 1) == 1);
  });
  run(loop, [&] { return stamp != TimePoint{}; });
  CHECK(stamp >= sent_at);
}

TEST_CASE("a terminal that hangs up is reported once, and later writes are refused") {
  RealLoop loop;
  Terminal terminal;
  auto link = open_serial(loop, {.path = terminal.path});
  REQUIRE(link);
  int reported = 0;
  Error why;
  (*link)->on_closed([&](const Error& e) {
    ++reported;
    why = e;
  });
  loop.after(1ms, [&] { terminal.hang_up(); });
  run(loop, [&] { return reported > 0; });
  CHECK(reported == 1);
  CHECK(why.code == Errc::io);
  CHECK(why.where == terminal.path);
  CHECK((*link)->write(every_byte()).error().code == Errc::io);
}

TEST_CASE("a port that is missing, no terminal, or in use is refused") {
  RealLoop loop;
  const auto missing = open_serial(loop, {.path = "/dev/ttyNOSUCH7"});
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == Errc::not_found);
  CHECK(missing.error().where == "/dev/ttyNOSUCH7");
  CHECK_FALSE(missing.error().hint.empty());
  CHECK_FALSE(open_serial(loop, {.path = "/dev/null"}));

  const Terminal terminal;
  const auto first = open_serial(loop, {.path = terminal.path});
  REQUIRE(first);
  const auto second = open_serial(loop, {.path = terminal.path});
  REQUIRE_FALSE(second);
  CHECK(second.error().code == Errc::busy);
}

// A pseudo-terminal in place of a real port, in a mount namespace of this thread.
TEST_CASE("a real port that another program has is refused before any setting of it is changed") {
  constexpr const char* port = "/dev/ttyS0";
  Terminal terminal;
  const int holder = ::open(terminal.path.c_str(), O_RDWR | O_NOCTTY);
  termios before{}, after{};
  REQUIRE(::tcgetattr(holder, &before) == 0);
  bool is_in_place = false;
  Errc locked{}, exclusive{};
  std::thread([&] {
    is_in_place = ::access("/sys/class/tty/ttyS0", F_OK) == 0 &&
                  ::unshare(CLONE_FS | CLONE_NEWNS) == 0 &&
                  ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                  ::mount(terminal.path.c_str(), port, nullptr, MS_BIND, nullptr) == 0;
    if (!is_in_place) return;
    RealLoop loop;
    const auto refusal = [&] {
      const auto link = open_serial(loop, {.path = port, .baud = 9600, .rts_cts = true});
      return link ? Errc{} : link.error().code;
    };
    ::flock(holder, LOCK_EX);
    locked = refusal();
    ::flock(holder, LOCK_UN);
    ::ioctl(holder, TIOCEXCL);
    exclusive = refusal();
  }).join();
  REQUIRE(::tcgetattr(holder, &after) == 0);
  ::close(holder);
  if (!is_in_place) {
    WARN("not tried: it needs root and a /dev/ttyS0");
    return;
  }
  CHECK(locked == Errc::busy);
  CHECK(exclusive == Errc::busy);
  CHECK(after.c_cflag == before.c_cflag);
  CHECK(after.c_lflag == before.c_lflag);
}

TEST_CASE("any speed is set and read back, 1.25 Mbaud too") {
  const Terminal terminal;
  for (const std::uint32_t baud : {19200U, 115200U, 1250000U}) {
    REQUIRE(set_line_speed(terminal.master, baud));
    RealLoop loop;
    CHECK(open_serial(loop, {.path = terminal.path, .baud = baud}));
  }
  const int no_line = ::open("/dev/null", O_RDWR);
  const auto refused = set_line_speed(no_line, 115200);
  ::close(no_line);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::unsupported);
}

TEST_CASE("a speed that is read back otherwise is taken up to 2 % off, either way") {
  for (const std::uint32_t got : {1000000U, 1019000U, 981000U}) CHECK(speed_taken(1000000, got));
  for (const std::uint32_t got : {1021000U, 979000U, 9600U, 0U})
    CHECK_FALSE(speed_taken(1000000, got));
}

TEST_CASE("a held port sends nothing early, drops what it held and then sends in order") {
  RealLoop loop;
  const Terminal terminal;
  auto link = open_serial(loop, {.path = terminal.path, .ftdi_start_up = true});
  REQUIRE(link);
  Bytes got;
  collect(**link, got);
  const TimePoint opened = loop.now();
  REQUIRE(::write(terminal.master, "old", 3) == 3);
  REQUIRE((*link)->write(Bytes{1, 2}));
  REQUIRE((*link)->write(Bytes{3}));
  ::fcntl(terminal.master, F_SETFL, O_NONBLOCK);
  Bytes out;
  run(loop, [&] {
    std::uint8_t byte = 0;
    while (::read(terminal.master, &byte, 1) == 1) out.push_back(byte);
    return out.size() >= 3;
  });
  CHECK(loop.now() - opened >= 100ms);
  CHECK(out == Bytes{1, 2, 3});
  CHECK(got.empty());
}

TEST_CASE("more than a far end takes waits, arrives in order, and is bounded") {
  RealLoop loop;
  int ends[2];
  REQUIRE(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0);
  auto link = adopt_stream(loop, ends[0], "pair");
  const Bytes piece(100000, 7);
  std::size_t sent = 0;
  Status last;
  while ((last = link->write(piece))) sent += piece.size();
  CHECK(last.error().code == Errc::io);
  CHECK(sent >= DescriptorLink::most_waiting - piece.size());

  ::fcntl(ends[1], F_SETFL, O_NONBLOCK);
  std::size_t got = 0;
  run(loop, [&] {
    std::uint8_t bytes[65536];
    for (ssize_t n = 0; (n = ::read(ends[1], bytes, sizeof bytes)) > 0;)
      got += static_cast<std::size_t>(n);
    return got == sent;
  });
  ::close(ends[1]);
}

TEST_CASE("TCP carries bytes both ways, and the end of the peer is reported") {
  RealLoop loop;
  const Server server(SOCK_STREAM);
  auto link = open_tcp(loop, server.end());
  REQUIRE(link);
  const int peer = ::accept(server.descriptor, nullptr, nullptr);
  REQUIRE(peer >= 0);
  Bytes got;
  collect(**link, got);
  bool closed = false;
  (*link)->on_closed([&](const Error&) { closed = true; });
  const Bytes sent = every_byte();
  REQUIRE(::write(peer, sent.data(), sent.size()) == 256);
  run(loop, [&] { return got.size() == 256; });
  CHECK(got == sent);
  ::close(peer);
  run(loop, [&] { return closed; });
}

TEST_CASE("each request goes out on a connection of its own, whoever ends the one before") {
  RealLoop loop;
  auto server = std::make_unique<Server>(SOCK_STREAM);
  auto link = open_requests(loop, server->end());
  REQUIRE(link);
  Bytes got;
  int ends = 0;
  (*link)->on_closed([&](const Error&) { ++ends; });
  // The callback of the first reply writes the second request, as a driver does.
  (*link)->on_receive([&](ByteView bytes, TimePoint) {
    got.insert(got.end(), bytes.begin(), bytes.end());
    if (got.size() == 2) CHECK((*link)->write(Bytes{'b'}));
  });
  CHECK((*link)->write(Bytes{'a'}));
  for (const char* reply : {"AA", "BB"}) {
    const int peer = ::accept(server->descriptor, nullptr, nullptr);
    REQUIRE(peer >= 0);
    char requested = 0;
    REQUIRE(::read(peer, &requested, 1) == 1);
    CHECK(requested == reply[0] - 'A' + 'a');
    REQUIRE(::write(peer, reply, 2) == 2);
    ::close(peer);
    run(loop, [&] { return got.size() == (reply[0] == 'A' ? 2 : 4); });
  }
  CHECK(got == Bytes{'A', 'A', 'B', 'B'});
  run(loop, [&] { return ends == 1; });
  server.reset();
  const Status refused = (*link)->write(Bytes{'c'});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::io);
  CHECK_FALSE(refused.error().got.empty());
}

TEST_CASE("TCP to a closed port or to an unknown name is refused") {
  RealLoop loop;
  Endpoint other_end;
  {
    const Server server(SOCK_STREAM);
    other_end = server.end();
  }
  const auto refused = open_tcp(loop, other_end);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::io);
  CHECK(open_tcp(loop, {"no-such-host.invalid", 1}).error().code == Errc::not_found);
}

TEST_CASE("UDP keeps datagrams apart and outlives a box that is not on yet") {
  RealLoop loop;
  Endpoint end;
  {
    const Server server(SOCK_DGRAM);
    end = server.end();
  }
  auto link = open_udp(loop, end);
  REQUIRE(link);
  bool closed = false;
  (*link)->on_closed([&](const Error&) { closed = true; });
  REQUIRE((*link)->write(Bytes{1}));  // answered by ICMP "unreachable"
  bool later = false;
  loop.after(5ms, [&] { later = true; });
  run(loop, [&] { return later; });
  CHECK_FALSE(closed);

  const Server server(SOCK_DGRAM);
  auto second = open_udp(loop, server.end());
  REQUIRE(second);
  std::vector<Bytes> got;
  (*second)->on_receive([&](ByteView b, TimePoint) { got.emplace_back(b.begin(), b.end()); });
  REQUIRE((*second)->write(Bytes{9, 9}));
  sockaddr_in from{};
  socklen_t size = sizeof from;
  Bytes buffer(16);
  REQUIRE(::recvfrom(server.descriptor, buffer.data(), buffer.size(), 0,
                     reinterpret_cast<sockaddr*>(&from), &size) == 2);
  for (const Bytes& b : {Bytes{1}, Bytes{2, 3}, Bytes{}, Bytes{4, 5, 6}})
    ::sendto(server.descriptor, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
  run(loop, [&] { return got.size() == 4; });
  CHECK(got[0].size() == 1);
  CHECK(got[1] == Bytes{2, 3});
  CHECK(got[2].empty());
  CHECK(got[3].size() == 3);
}

TEST_CASE("UDP receives at its own port from any sender, and reports a port in use") {
  RealLoop loop;
  const Server device(SOCK_DGRAM);
  std::uint16_t own = 0;
  {
    const Server free(SOCK_DGRAM);
    own = free.port;
  }
  auto link = open_udp(loop, device.end(), own);
  REQUIRE(link);
  Bytes got;
  collect(**link, got);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(own);
  REQUIRE(::sendto(device.descriptor, "ab", 2, 0, reinterpret_cast<sockaddr*>(&to), sizeof to) ==
          2);
  run(loop, [&] { return got.size() == 2; });
  const auto second = open_udp(loop, device.end(), own);
  REQUIRE_FALSE(second);
  CHECK(second.error().code == Errc::io);
  CHECK(second.error().where == std::to_string(own));
}

TEST_CASE("a link may be destroyed by the callback that it runs") {
  RealLoop loop;
  const Terminal terminal;
  auto opened = open_serial(loop, {.path = terminal.path});
  REQUIRE(opened);
  std::unique_ptr<Link> link = std::move(*opened);
  int calls = 0;
  link->on_receive([&](ByteView, TimePoint) {
    ++calls;
    link.reset();
  });
  REQUIRE(::write(terminal.master, "ab", 2) == 2);
  run(loop, [&] { return calls == 1; });
  CHECK(link == nullptr);
}

}  // namespace port_link_test
