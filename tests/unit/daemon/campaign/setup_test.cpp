// weft init: who has which role, what a controller may have, how a port is asked, boxes in a
// network.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/campaign/setup/device_search.hpp"
#include "daemon/campaign/setup/rig_writer.hpp"

namespace setup_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

FoundDevice stage(const std::string& model, const std::string& serial, std::uint16_t stage_id = 0) {
  FoundDevice out;
  out.kind = DeviceKind::stage;
  out.place = "/dev/" + serial;
  out.link = SerialSettings{.path = out.place};
  out.model = model;
  out.serial = serial;
  out.stages = stages_of_controller(model, stage_id);
  return out;
}

FoundDevice sensor(DeviceKind kind, const std::string& place, double rate_hz) {
  FoundDevice out;
  out.kind = kind;
  out.place = place;
  out.link = UdpPort{{"192.168.1.1", 49152}};
  out.rate_hz = rate_hz;
  out.taxels = kind == DeviceKind::taxel_array ? 16 : 0;
  return out;
}

std::string role_of(const RigDraft& draft, const std::string& serial) {
  for (const DraftDevice& device : draft.devices)
    if (device.found.serial == serial) return device.role;
  return "not there";
}

json written(const RigDraft& draft) {
  const auto text = rig_text(draft);
  REQUIRE(text);
  REQUIRE(parse_rig_file(*text));
  return json::parse(*text);
}

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
  Port() : descriptor(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof here;
    REQUIRE(::bind(descriptor, reinterpret_cast<sockaddr*>(&here), size) == 0);
    REQUIRE(::getsockname(descriptor, reinterpret_cast<sockaddr*>(&here), &size) == 0);
    number = ntohs(here.sin_port);
  }
  ~Port() { ::close(descriptor); }
  int descriptor;
  std::uint16_t number = 0;
};

/// Replies to one request as so many boxes, where and when it asks for that.
void reply_as_boxes(int descriptor, std::uint16_t reply_port,
                    const std::vector<protocols::rdt::DiscoveryReply>& boxes) {
  std::array<std::uint8_t, 256> bytes{};
  const ssize_t size = ::recv(descriptor, bytes.data(), bytes.size(), 0);
  const auto request = protocols::rdt::decode_discovery_request(
      ByteView(bytes).first(static_cast<std::size_t>(std::max<ssize_t>(size, 0))));
  if (!request) return;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  std::copy(request->reply_to.begin(), request->reply_to.end(),
            reinterpret_cast<std::uint8_t*>(&to.sin_addr));
  to.sin_port = htons(reply_port);
  for (const auto& box : boxes) {
    const Bytes reply = encode(box);
    ::sendto(descriptor, reply.data(), reply.size(), 0, reinterpret_cast<sockaddr*>(&to),
             sizeof to);
  }
}

}  // namespace

TEST_CASE("Stages have roles by serial number, linear ones apart from rotary ones") {
  const RigDraft draft = draft_of(
      "bench", BenchMode::real,
      {stage("KDC101", "27000009", 6), stage("LTS150", "45000003"), stage("K10CR1", "55000001"),
       stage("LTS300", "45000001"), stage("LTS150", "45000002")});
  CHECK(role_of(draft, "45000001") == "x");
  CHECK(role_of(draft, "45000002") == "y");
  CHECK(role_of(draft, "45000003") == "z");
  CHECK(role_of(draft, "27000009") == "rx");
  CHECK(role_of(draft, "55000001") == "ry");
  CHECK(draft.with_role("x")->stage == "LTS300");
  CHECK(draft.with_role("rx")->stage == "PRM1-Z8");
}

TEST_CASE("Two linear stages are x and z, and y is fixed in the plate's middle") {
  RigDraft draft = draft_of("bench", BenchMode::real,
                            {stage("LTS150", "45000001"), stage("KDC101", "27000001", 7),
                             sensor(DeviceKind::net_ft, "192.168.1.1", 0)});
  CHECK(draft.with_role("x")->found.serial == "27000001");  // numbers, not models
  CHECK(draft.with_role("x")->stage == "MTS25-Z8");
  CHECK(missing_parts(draft).empty());
  REQUIRE(set_number(draft, "plate_y_mm", 80));
  const json rig = written(draft);
  CHECK(rig["fixed"] == json{{"y_mm", 40}, {"rx_deg", 0}, {"ry_deg", 0}});
  CHECK(rig["limits"]["acceleration_mm_s2"] == 5);  // of the slower stage
  CHECK(rig["limits"]["travel_mm"]["x"] == json{0, 25});
  CHECK(rig["plate"]["size_mm"] == json{25, 80});
  CHECK_FALSE(rig["limits"].contains("tilt_deg"));
}

TEST_CASE("A controller without a stage's name is asked about, and its scale is written") {
  RigDraft draft =
      draft_of("bench", BenchMode::real,
               {stage("BSC101", "40000001"), stage("LTS150", "45000001"),
                stage("LTS150", "45000002"), sensor(DeviceKind::taxel_array, "/dev/t", 37)});
  const auto missing = missing_parts(draft);
  REQUIRE(missing.size() == 1);
  CHECK(missing[0].where == "/dev/40000001");
  CHECK(missing[0].expected == "LTS150, NRT150");
  CHECK(set_stage(draft, "40000001", "MTS25-Z8").error().code == Errc::invalid_argument);
  REQUIRE(set_stage(draft, "40000001", "NRT150"));
  CHECK(missing_parts(draft).empty());
  const json config = written(draft)["devices"][0]["config"];
  CHECK(config["stage"] == "NRT150");
  CHECK(config["controller"] == "BSC101");
  CHECK(config["serial"] == 40000001);
}

TEST_CASE("What is missing is said, all of it") {
  RigDraft draft = draft_of("bench", BenchMode::real, {stage("LTS150", "45000001")});
  CHECK(draft.with_role("z") != nullptr);
  CHECK(missing_parts(draft).size() == 2);  // x and a sensor
  REQUIRE(set_role(draft, "45000001", "none"));
  CHECK(missing_parts(draft).size() == 3);
  draft.devices.push_back(draft.devices.front());
  draft.devices[1].found.serial = "45000002";
  REQUIRE(set_role(draft, "45000001", "x"));
  REQUIRE(set_role(draft, "45000002", "x"));
  CHECK(missing_parts(draft).size() == 4);  // z, a sensor, and x twice
  CHECK(set_role(draft, "45000001", "wrench").error().code == Errc::invalid_argument);
  CHECK(set_role(draft, "1", "x").error().code == Errc::not_found);
}

TEST_CASE("Answers are roles, stages and numbers, and others are refused") {
  RigDraft draft = draft_of("bench", BenchMode::real,
                            {stage("LTS150", "45000001"), stage("LTS150", "45000002")});
  REQUIRE(apply_answers(draft, R"({"roles": {"45000001": "z", "/dev/45000002": "x"},
                                   "surface_z_mm": 42.5})"));
  CHECK(role_of(draft, "45000001") == "z");
  CHECK(draft.number("surface_z_mm") == 42.5);
  const auto refused = [&](const char* text) { return apply_answers(draft, text).error(); };
  CHECK(refused("[]").code == Errc::parse);
  CHECK(refused(R"({"surfase_z_mm": 1})").code == Errc::not_found);
  CHECK(refused(R"({"surface_z_mm": "high"})").where == "/surface_z_mm");
  CHECK(refused(R"({"surface_z_mm": 1e9})").code == Errc::range);
  CHECK(refused(R"({"roles": {"45000001": 3}})").where == "/roles/45000001");
}

TEST_CASE(
    "A sensor is taken as it sends: averaged where it is fast, its pages where they are read") {
  std::vector<FoundDevice> devices{stage("LTS150", "45000001"), stage("LTS150", "45000002"),
                                   sensor(DeviceKind::digital_ft, "/dev/ft", 7000)};
  devices.back().serial = "FT12345";
  const json config = written(draft_of("a", BenchMode::real, devices))["devices"][2]["config"];
  CHECK(config == json{{"rate_hz", 500}, {"average", 14}, {"calibration_serial", "FT12345"}});
  devices.back().kind = DeviceKind::net_ft;
  const json blind = written(draft_of("a", BenchMode::real, devices))["devices"][2]["config"];
  CHECK(blind["counts_per_newton"] == 1000000);
  CHECK_FALSE(blind.contains("calibration_serial"));  // it needs the pages
  devices.back().http = TcpPort{{"192.168.1.1", 80}};
  const json seen = written(draft_of("a", BenchMode::real, devices))["devices"][2];
  CHECK(seen["config"]["calibration_serial"] == "FT12345");
  CHECK_FALSE(seen["config"].contains("counts_per_newton"));
  CHECK(seen["http"]["port"] == 80);
}

TEST_CASE("Rates are as a person would state them") {
  CHECK(rounded_rate_hz(499.2) == 500);
  CHECK(rounded_rate_hz(36.97) == 37);
  CHECK(rounded_rate_hz(6985) == 7000);
  CHECK(rounded_rate_hz(123.4) == Approx(123.4).epsilon(0.01));
  CHECK(rounded_rate_hz(0) == 0);
  CHECK(rounded_rate_hz(std::numeric_limits<double>::infinity()) == 0);  // a clock that stands
}

TEST_CASE("A port is asked what its USB numbers allow") {
  using Openings = std::vector<std::pair<std::uint32_t, std::string>>;
  const SerialSettings port{.path = "/dev/ttyUSB7"};
  CHECK(openings(attempts_for(port, 0x0403, 0xFAF0)) == Openings{{115200, "stage"}});
  const Openings listens{{115200, "listens"}, {460800, "listens"}, {921600, "listens"}};
  CHECK(openings(attempts_for(port, 0x2341, 0x0043)) == listens);  // nothing is written to it
  Openings ftdi = listens;
  ftdi.insert(ftdi.end(), {{1250000, "digital"}, {115200, "digital"}});
  CHECK(openings(attempts_for(port, 0x0403, 0x6001)) == ftdi);
  Openings named{{115200, "stage"}};
  named.insert(named.end(), ftdi.begin(), ftdi.end());
  CHECK(openings(attempts_for(port, -1, -1)) == named);
  const auto last = attempts_for(port, 0x0403, 0x6001).back();
  CHECK(std::get<SerialSettings>(last.link).parity == Parity::even);
}

TEST_CASE("A port's name is udev's link to it, which stays") {
  std::string folder = (fs::temp_directory_path() / "weft-by-id-XXXXXX").string();
  REQUIRE(::mkdtemp(folder.data()) != nullptr);
  const std::string link = folder + "/usb-Thorlabs_45000001-if00-port0";
  fs::create_symlink("/dev/null", link);
  fs::create_symlink("/dev/zero", folder + "/usb-other");
  CHECK(stable_port_name("/dev/null", folder) == link);
  CHECK(stable_port_name("/dev/full", folder) == "/dev/full");
  CHECK(stable_port_name("/dev/null", folder + "/none") == "/dev/null");
  fs::remove_all(folder);
}

TEST_CASE("Boxes that reply to the broadcast are found, each once") {
  const Port network;
  std::uint16_t free_port = 0;
  {
    const Port other;
    free_port = other.number;
  }
  const protocols::rdt::DiscoveryReply second{
      "00-16-bd-00-00-02", {192, 168, 1, 2}, {255, 255, 255, 0}, "Net F/T", ""};
  const protocols::rdt::DiscoveryReply first{
      "00-16-bd-00-00-01", {192, 168, 1, 1}, {255, 255, 255, 0}, "Net F/T", ""};
  std::thread boxes([&] {
    reply_as_boxes(network.descriptor, free_port, {second, first, second});
  });
  const auto found = find_boxes({"127.0.0.1", network.number, free_port, {{127, 0, 0, 1}, 1}});
  boxes.join();
  REQUIRE(found);
  REQUIRE(found->size() == 2);
  CHECK((*found)[0] == first);
  CHECK((*found)[1] == second);
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

TEST_CASE("A rig file is never written over another one, and not where it would be refused") {
  std::string folder = (fs::temp_directory_path() / "weft-init-XXXXXX").string();
  REQUIRE(::mkdtemp(folder.data()) != nullptr);
  RigDraft draft = draft_of("bench", BenchMode::real,
                            {stage("LTS150", "45000001"), stage("LTS150", "45000002"),
                             sensor(DeviceKind::net_ft, "192.168.1.1", 500)});
  const fs::path rig = fs::path(folder) / "rig.json";
  REQUIRE(write_rig(draft, rig));
  CHECK(write_rig(draft, rig).error().code == Errc::wrong_state);
  CHECK(require_new_file(rig).error().code == Errc::wrong_state);
  draft.devices[0].found.destination = 0x05;  // no address of a unit
  CHECK_FALSE(write_rig(draft, fs::path(folder) / "bad.json"));
  CHECK(std::distance(fs::directory_iterator(folder), {}) == 1);  // nothing is left beside it
  fs::remove_all(folder);
}

}  // namespace setup_test
