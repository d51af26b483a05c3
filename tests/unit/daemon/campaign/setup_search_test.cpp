// Queries of a port, ports that are not opened, boxes in a network, and all of them at once.
#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <filesystem>
#include <thread>

#include "daemon/campaign/setup/device_search.hpp"
#include "daemon/hardware/link/descriptor_link.hpp"
#include "protocols/apt/bodies.hpp"

namespace setup_search_test {

using namespace weft;
using namespace weft::daemon;
namespace fs = std::filesystem;

namespace {

std::vector<std::pair<std::uint32_t, std::string>> openings(
    const std::vector<PortAttempt>& attempts) {
  std::vector<std::pair<std::uint32_t, std::string>> out;
  for (const PortAttempt& attempt : attempts)
    out.emplace_back(std::get<SerialSettings>(attempt.link).baud, attempt.asks_stage ? "stage"
                                                                  : attempt.asks_digital
                                                                      ? "digital"
                                                                      : "listens");
  return out;
}

/// A datagram socket on a free port of this machine.
struct Port {
  explicit Port(const protocols::rdt::Ipv4& host = {127, 0, 0, 1})
      : descriptor(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in here{};
    here.sin_family = AF_INET;
    std::copy(host.begin(), host.end(), reinterpret_cast<std::uint8_t*>(&here.sin_addr));
    socklen_t size = sizeof here;
    REQUIRE(::bind(descriptor, reinterpret_cast<sockaddr*>(&here), size) == 0);
    REQUIRE(::getsockname(descriptor, reinterpret_cast<sockaddr*>(&here), &size) == 0);
    number = ntohs(here.sin_port);
  }
  ~Port() { ::close(descriptor); }
  int descriptor;
  std::uint16_t number = 0;
};

struct Folder {
  explicit Folder(const char* pattern) {
    std::string name = (fs::temp_directory_path() / pattern).string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    path = name;
  }
  ~Folder() { fs::remove_all(path); }
  fs::path path;
};

protocols::rdt::DiscoveryReply reply_of(std::uint8_t box) {
  return {"00-16-bd-00-00-01", {127, 0, 0, box}, {255, 0, 0, 0}, "Net F/T", ""};
}

struct Replies {
  std::vector<protocols::rdt::DiscoveryReply> own;     ///< each from its own address
  std::vector<protocols::rdt::DiscoveryReply> others;  ///< from 127.0.0.9
};

sockaddr_in address_of(const protocols::rdt::Ipv4& host, std::uint16_t port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  std::copy(host.begin(), host.end(), reinterpret_cast<std::uint8_t*>(&out.sin_addr));
  out.sin_port = htons(port);
  return out;
}

void send_from(const protocols::rdt::Ipv4& host, const sockaddr_in& to,
               const protocols::rdt::DiscoveryReply& reply) {
  const Port sender(host);
  const Bytes bytes = encode(reply);
  ::sendto(sender.descriptor, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
}

/// Replies to one request like several boxes, at the requested port.
void reply_as_boxes(int descriptor, std::uint16_t reply_port, const Replies& replies) {
  std::array<std::uint8_t, 256> bytes{};
  const timeval patience{5, 0};  // a failed search sends nothing
  ::setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  const ssize_t size = ::recv(descriptor, bytes.data(), bytes.size(), 0);
  const auto request = protocols::rdt::decode_discovery_request(
      ByteView(bytes).first(static_cast<std::size_t>(std::max<ssize_t>(size, 0))));
  if (!request) return;
  const sockaddr_in to = address_of(request->reply_to, reply_port);
  for (const auto& reply : replies.others) send_from({127, 0, 0, 9}, to, reply);
  for (const auto& reply : replies.own) send_from(reply.address, to, reply);
}

/// A pseudo-terminal at which an LTS150 identifies itself on request.
class FakeStage {
 public:
  FakeStage() : master_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    REQUIRE((master_ >= 0 && ::grantpt(master_) == 0 && ::unlockpt(master_) == 0));
    path = ::ptsname(master_);
    thread_ = std::thread([this] { reply(); });
  }
  ~FakeStage() {
    stop_ = true;
    thread_.join();
  }
  std::string path;

 private:
  void reply() {
    using namespace std::chrono_literals;
    namespace apt = protocols::apt;
    apt::HardwareInfo info{};
    info.serial = 45000001;
    info.model = apt::Text<8>::from("LTS150");
    Bytes out;
    apt::append_message(out, apt::MessageId::hw_get_info, info,
                        {apt::address::host, apt::address::usb_unit});
    RealLoop loop;
    DescriptorLink line(loop, master_, Framing::terminals, path);
    line.on_vacant([&] { loop.after(5ms, [&] { line.resume(); }); });
    const Duration usb_latency = 20ms;
    line.on_receive([&](ByteView, TimePoint) {
      loop.after(usb_latency, [&] { static_cast<void>(line.write(out)); });
    });
    loop.run_until([this] { return stop_.load(); });
  }

  int master_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// Accepts no connection: clients wait.
struct FullServer {
  FullServer() : listener(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in here = address_of({127, 0, 0, 1}, 0);
    socklen_t size = sizeof here;
    REQUIRE(::bind(listener, reinterpret_cast<sockaddr*>(&here), size) == 0);
    REQUIRE(::listen(listener, 0) == 0);
    REQUIRE(::getsockname(listener, reinterpret_cast<sockaddr*>(&here), &size) == 0);
    port = ntohs(here.sin_port);
    REQUIRE(::connect(first, reinterpret_cast<sockaddr*>(&here), size) == 0);
  }
  ~FullServer() {
    ::close(first);
    ::close(listener);
  }
  int listener, first = ::socket(AF_INET, SOCK_STREAM, 0);
  std::uint16_t port = 0;
};

std::vector<std::string> places(const std::vector<Error>& errors) {
  std::vector<std::string> out;
  for (const Error& error : errors) out.push_back(error.where);
  return out;
}

}  // namespace

TEST_CASE("An unnamed port is opened only if it is Thorlabs' and no program can be hidden") {
  using Openings = std::vector<std::pair<std::uint32_t, std::string>>;
  SerialPortSeen port;
  port.name = "/dev/ttyUSB7";
  port.usb_vendor = 0x0403;
  port.usb_product = 0xFAF0;
  const Openings stage_alone{{115200, "stage"}};
  CHECK(openings(plan_unnamed(port, true, "/none").attempts) == stage_alone);
  const PortPlan hidden = plan_unnamed(port, false, "/none");
  CHECK(hidden.attempts.empty());
  REQUIRE(hidden.found.problem);
  CHECK(hidden.found.is_expected);  // a rig file without it would be wrong
  CHECK(openings(plan_named(port.name, {port}, "/none").attempts) == stage_alone);
  for (const auto& [vendor, product] : {std::pair(0x0403, 0x6001), {0x2341, 0x0043}}) {
    port.usb_vendor = vendor;
    port.usb_product = product;
    const PortPlan other = plan_unnamed(port, true, "/none");
    CHECK(other.attempts.empty());
    CHECK_FALSE(other.found.is_expected);
    CHECK(other.found.notes.size() == 1);
  }
  const PortPlan named = plan_named(port.name, {port}, "/none");
  CHECK(openings(named.attempts) == Openings{{115200, "stage"},
                                             {115200, "listens"},
                                             {460800, "listens"},
                                             {921600, "listens"},
                                             {1250000, "digital"},
                                             {115200, "digital"}});
  CHECK(std::get<SerialSettings>(named.attempts.back().link).parity == Parity::even);
}

TEST_CASE("Programs of other users are hidden where their folders are") {
  const Folder processes("weft-proc-XXXXXX");
  CHECK_FALSE(can_see_holders(processes.path));  // not even process 1 is visible
  fs::create_directories(processes.path / "1/fd");
  fs::create_directories(processes.path / "27/fd");
  CHECK(can_see_holders(processes.path));
  if (::geteuid() == 0) return;  // root can see all
  fs::permissions(processes.path / "27/fd", fs::perms::none);
  CHECK_FALSE(can_see_holders(processes.path));
  fs::permissions(processes.path / "27/fd", fs::perms::owner_all);
}

TEST_CASE("A port's name is udev's link to it, which stays; a link that was named is one") {
  const Folder by_id("weft-by-id-XXXXXX");
  const fs::path link = by_id.path / "usb-Thorlabs_45000001-if00-port0",
                 other = by_id.path / "other";
  fs::create_symlink("/dev/null", link);
  fs::create_symlink("/dev/zero", other);
  CHECK(stable_port_name("/dev/null", by_id.path) == link);
  CHECK(stable_port_name("/dev/full", by_id.path) == "/dev/full");
  CHECK(stable_port_name("/dev/null", by_id.path / "none") == "/dev/null");
  const Folder own("weft-own-XXXXXX");
  fs::create_symlink("/dev/null", own.path / "45000001");
  CHECK(stable_port_name(own.path / "45000001", by_id.path) == own.path / "45000001");
}

TEST_CASE("Boxes that reply to the broadcast are found, each once") {
  const Port network;
  std::uint16_t free_port = 0;
  {
    const Port other;
    free_port = other.number;
  }
  const Replies two{{reply_of(3), reply_of(2), reply_of(3)}, {}};
  std::thread boxes([&] { reply_as_boxes(network.descriptor, free_port, two); });
  const BoxSearch search{"127.0.0.1", network.number, free_port, {{127, 0, 0, 1}, 1}};
  const auto found = find_boxes(search);
  boxes.join();
  REQUIRE(found);
  CHECK(*found == Replies{{reply_of(2), reply_of(3)}, {}}.own);
}

TEST_CASE("Replies of another's address are dropped, and boxes beyond 32 are passed over") {
  const Port network;
  std::uint16_t free_port = 0;
  {
    const Port other;
    free_port = other.number;
  }
  Replies many{{}, {reply_of(2), reply_of(3)}};
  for (std::uint8_t box = 10; box < 60; ++box) many.own.push_back(reply_of(box));
  std::thread boxes([&] { reply_as_boxes(network.descriptor, free_port, many); });
  const auto found = find_boxes({"127.0.0.1", network.number, free_port, {{127, 0, 0, 1}, 4}});
  boxes.join();
  REQUIRE(found);
  CHECK(found->size() == most_boxes);
  CHECK(found->front() == reply_of(10));
}

TEST_CASE("A box is named by its host, the port of its records and that of its pages") {
  const auto usual = parse_box_place("192.168.1.1");
  REQUIRE(usual);
  CHECK(usual->records.port == 49152);
  CHECK(usual->pages.port == 80);
  CHECK(parse_box_place("box:5000")->pages.port == 0);
  CHECK(parse_box_place("box:5000/8080")->pages.port == 8080);
  for (const char* const bad : {"", ":1", "box/80", "box:", "box:1/", "box:70000", "box:1/x"})
    CHECK(parse_box_place(bad).error().code == Errc::invalid_argument);
}

TEST_CASE("A box that takes no connection keeps no stage from being found, by its stable name") {
  const Folder folder("weft-search-XXXXXX");
  const FullServer box;
  const FakeStage stage_port, left_out;
  const fs::path link = folder.path / "usb-Thorlabs";
  fs::create_symlink(stage_port.path, link);
  SearchRequest request;
  const std::string box_place = "127.0.0.1:9/" + std::to_string(box.port);
  request.ports = {stage_port.path, left_out.path};
  request.boxes = {box_place};
  request.left_out = {left_out.path, "/dev/none"};
  request.search_ports = request.search_network = false;
  request.lock_folder = request.by_id = folder.path;
  const auto report = search_devices(request);
  REQUIRE(report);
  REQUIRE(report->devices.size() == 2);
  const FoundDevice& found = report->devices[0];
  CHECK(found.kind == DeviceKind::stage);
  CHECK(found.serial == "45000001");
  CHECK(found.place == stage_port.path);
  CHECK(std::get<SerialSettings>(found.link).path == link);
  CHECK(report->left_out == std::set<std::string>{left_out.path});
  const auto silent = unanswered(*report);
  CHECK(places(silent) == std::vector<std::string>{box_place});
  CHECK(silent[0].hint.find("--role " + box_place + "=none") != std::string::npos);
}

}  // namespace setup_search_test
