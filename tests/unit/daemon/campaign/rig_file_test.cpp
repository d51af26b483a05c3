// Promises that a rig file must not make, and the provenance that a bench states.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "sim/rig/rig_config.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace rig_file_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;

namespace {

Error refusal(const json& rig) {
  const Result<RigFile> parsed = parse_rig_file(rig.dump());
  REQUIRE_FALSE(parsed);
  return parsed.error();
}

}  // namespace

TEST_CASE("the rig file of this tree is a simulated bench with a device for each role") {
  const Result<RigFile> rig =
      parse_rig_file(test::read_file(test::source / "sim/rigs/bench17.json"));
  REQUIRE(rig);
  CHECK(rig->bench == BenchKind::simulated);
  CHECK(rig->plant_level == "auto");
  CHECK(rig->devices.size() == 7);
}

TEST_CASE("a key given twice in a rig file is refused with its pointer") {
  std::string text = test::read_file(test::source / "sim/rigs/bench17.json");
  const std::string first = "\"limits\": {";
  text.insert(text.find(first) + first.size(), "\"speed_mm_s\": 1, ");
  const Result<RigFile> rig = parse_rig_file(text);
  REQUIRE_FALSE(rig);
  CHECK(rig.error().where == "/limits/speed_mm_s");
  CHECK(sim::parse_rig_config(text).error().where == "rig file: /limits/speed_mm_s");
}

TEST_CASE("data of an emulated bench are simulated, those of a real one are not") {
  json rig = json::parse(test::read_file(test::source / "sim/rigs/emulated17.json"));
  const RigFile emulated = parse_rig_file(rig.dump()).value();
  CHECK(emulated.mode == BenchMode::emulated);
  CHECK(emulated.bench == BenchKind::simulated);
  CHECK(emulated.console.port == 7037);
  rig["bench"] = "real";
  const RigFile real = parse_rig_file(rig.dump()).value();
  CHECK(real.mode == BenchMode::real);
  CHECK(real.bench == BenchKind::real);
  rig["bench"] = "imaginary";
  CHECK(refusal(rig).where == "/bench");
  rig["bench"] = "emulated";
  rig["simulation"].erase("console");
  CHECK(refusal(rig).where == "/simulation/console");
}

TEST_CASE("the emulated rig file of this tree differs from the simulated one in ports and rates") {
  json simulated = test::bench17();
  json emulated = json::parse(test::read_file(test::source / "sim/rigs/emulated17.json"));
  for (json* rig : {&simulated, &emulated}) {
    for (json& device : (*rig)["devices"]) device.erase("link");
    (*rig)["simulation"].erase("console");
    (*rig)["simulation"].erase("fabrics");
    rig->erase("name");
    rig->erase("bench");
  }
  // In real time the loop runs at 250 Hz; the demo's campaign uses 100 Hz.
  emulated["control"]["cycle_hz"] = 100;
  json& sensor = test::device_of(emulated, "wrench");
  sensor["config"]["rate_hz"] = sensor["emulator"]["rate_hz"] = 100;
  CHECK(simulated == emulated);
}

TEST_CASE("each kind of link is read with its settings") {
  const auto serial = parse_link(
      R"({"kind": "serial", "path": "/dev/ttyUSB0", "baud": 1250000, "parity": "even", "rts_cts": true})",
      "/link");
  REQUIRE(serial);
  const auto& line = std::get<SerialSettings>(*serial);
  CHECK(line.path == "/dev/ttyUSB0");
  CHECK(line.baud == 1250000);
  CHECK(line.parity == Parity::even);
  CHECK(line.rts_cts);
  CHECK_FALSE(line.ftdi_start_up);
  const auto udp = parse_link(R"({"kind": "udp", "host": "192.168.1.1", "port": 49152})", "/link");
  REQUIRE(udp);
  CHECK(std::get<UdpPort>(*udp).end.host == "192.168.1.1");
  CHECK(std::get<UdpPort>(*udp).end.port == 49152);
  CHECK(std::get<UdpPort>(*udp).local_port == 0);
  const auto unasked = parse_link(
      R"({"kind": "udp", "host": "192.168.1.7", "port": 2390, "local_port": 10240})", "/link");
  REQUIRE(unasked);
  CHECK(std::get<UdpPort>(*unasked).end.port == 2390);
  CHECK(std::get<UdpPort>(*unasked).local_port == 10240);
  CHECK(std::holds_alternative<TcpPort>(
      parse_link(R"({"kind": "tcp", "host": "::1", "port": 1})", "").value()));
}

TEST_CASE("a link with a wrong kind, key or value is refused at its JSON pointer") {
  const auto where = [](const char* link) {
    const auto read = parse_link(link, "/link");
    REQUIRE_FALSE(read);
    return read.error().where;
  };
  CHECK(where(R"({"kind": "pty"})") == "/link/kind");
  CHECK(where(R"({"port": "/dev/ttyUSB0"})") == "/link/kind");
  CHECK(where(R"("memory")") == "/link");
  CHECK(where(R"({"kind": "memory", "port": 1})") == "/link/port");
  CHECK(where(R"({"kind": "serial"})") == "/link/path");
  CHECK(where(R"({"kind": "serial", "path": 7})") == "/link/path");
  CHECK(where(R"({"kind": "serial", "path": "/dev/x", "baud": 0})") == "/link: /baud");
  CHECK(where(R"({"kind": "serial", "path": "/dev/x", "parity": "mark"})") == "/link: /parity");
  CHECK(where(R"({"kind": "serial", "path": "/dev/x", "host": "y"})") == "/link: /host");
  CHECK(where(R"({"kind": "udp", "host": "y"})") == "/link/port");
  CHECK(where(R"({"kind": "udp", "host": "y", "port": 1, "local_port": 65536})") ==
        "/link: /local_port");
  CHECK(where(R"({"kind": "tcp", "host": "y", "port": 1, "local_port": 2})") ==
        "/link: /local_port");
  CHECK(where(R"({"kind": "udp", "host": "y", "port": 65536})") == "/link: /port");
  CHECK(where(R"({"kind": "tcp", "host": "y", "port": 1e999})") == "/link");
}

TEST_CASE("a simulated bench has links in memory only, a real one ports only") {
  json rig = test::bench17();
  rig["devices"][5]["link"] = {{"kind", "udp"}, {"host", "192.168.1.1"}, {"port", 49152}};
  Error error = refusal(rig);
  CHECK(error.where == "/devices/5/link");
  CHECK(error.got == "a port");
  rig = test::bench17();
  rig["bench"] = "real";
  error = refusal(rig);
  CHECK(error.where == "/devices/0/link");
  CHECK(error.got == "memory");
}

TEST_CASE("a command port is served by weft-rig on TCP, and nowhere else") {
  json rig = json::parse(test::read_file(test::source / "sim/rigs/emulated17.json"));
  rig["devices"][5]["commands"] = {{"kind", "tcp"}, {"host", "127.0.0.1"}, {"port", 49151}};
  CHECK(parse_rig_file(rig.dump()));
  rig["bench"] = "real";
  CHECK(refusal(rig).where == "/devices/5/commands");
  rig["bench"] = "emulated";
  rig["devices"][5]["commands"]["kind"] = "udp";
  CHECK(refusal(rig).where == "/devices/5/commands");
}

TEST_CASE("unknown keys of the rig and of a device are refused with the key that was meant") {
  json rig = test::bench17();
  rig["limit"] = json::object();
  CHECK(refusal(rig).where == "/limit");
  CHECK(refusal(rig).hint.find("limits") != std::string::npos);
  rig = test::bench17();
  rig["devices"][2]["confg"] = json::object();
  CHECK(refusal(rig).where == "/devices/2/confg");
  CHECK(refusal(rig).hint.find("config") != std::string::npos);
}

TEST_CASE("a rate that driver and emulator do not share is refused before anything moves") {
  const test::TemporaryFolder folder;
  json rig = test::bench17();
  test::device_of(rig, "wrench")["config"]["rate_hz"] = 500;
  const auto ran = run_campaign(test::request_in(folder, test::short_recipe("denim"), rig), {});
  REQUIRE_FALSE(ran);
  CHECK(ran.error().where.find("/devices/5/config/rate_hz") != std::string::npos);
  CHECK(ran.error().got.find("500") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_CASE("on a real bench an emulator entry in the rig file does not affect the stage") {
  json rig = test::bench17_near_home();
  rig["devices"][0]["emulator"]["model"] = "LTS150";
  REQUIRE(parse_rig_file(rig.dump())->devices[0].emulated_model == "LTS150");
  rig["bench"] = "real";
  for (json& device : rig["devices"])
    device["link"] = {{"kind", "serial"}, {"path", "/dev/" + device["name"].get<std::string>()}};
  const auto real = parse_rig_file(rig.dump());
  if (!real) FAIL(to_string(real.error()));
  CHECK(real->devices[0].emulated_model.empty());
  CHECK(real->devices[0].emulated_stage.empty());
}

TEST_CASE("a linear stage gets the rig's acceleration; another value is refused") {
  nlohmann::json rig = test::bench17();
  rig["limits"]["acceleration_mm_s2"] = 10;
  const auto config_of = [&](const char* role) {
    const RigFile file = parse_rig_file(rig.dump()).value();
    const auto entry = std::ranges::find(file.devices, role, &DeviceEntry::role);
    return driver_config(*entry, *file.drivers);
  };
  for (const double other : {5.0, 20.0}) {
    test::device_of(rig, "y")["config"]["acceleration_mm_s2"] = other;
    const auto refused = config_of("y");
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == "/acceleration_mm_s2");
    CHECK_THAT(to_string(refused.error()), Catch::Contains("10.0 mm/s2"));
  }
  test::device_of(rig, "y")["config"]["acceleration_mm_s2"] = 10;
  CHECK(config_of("y"));
  test::device_of(rig, "y")["config"].erase("acceleration_mm_s2");
  CHECK(nlohmann::json::parse(config_of("y").value())["acceleration_mm_s2"] == 10);
  for (const char* role : {"rx", "wrench"}) {
    INFO(role);
    CHECK_FALSE(nlohmann::json::parse(config_of(role).value()).contains("acceleration_mm_s2"));
  }
}

TEST_CASE("an acceleration limit that no stage supports is refused at its key, once") {
  const test::TemporaryFolder folder;
  nlohmann::json rig = test::bench17();
  for (const char* role : {"x", "y", "z"})
    test::device_of(rig, role)["config"].erase("acceleration_mm_s2");
  for (const auto& [key, value] :
       {std::pair{"acceleration_mm_s2", 100.0}, {"acceleration_mps2", 0.1}}) {
    rig["limits"].erase("acceleration_mm_s2");
    rig["limits"][key] = value;
    const auto ran = run_campaign(test::request_in(folder, test::short_recipe("denim"), rig), {});
    REQUIRE_FALSE(ran);
    CHECK_THAT(ran.error().where, Catch::EndsWith(std::string("/limits/") + key));
    CHECK_THAT(ran.error().got, Catch::Contains("100"));
    CHECK((ran.error().hint.find("mm/s2") != std::string::npos) == (value < 1));
  }
}

TEST_CASE("the stages of a bench get its acceleration with their speeds") {
  nlohmann::json rig = test::bench17();
  rig["limits"].erase("acceleration_mm_s2");
  rig["limits"]["acceleration_mps2"] = 0.01;
  for (const char* role : {"x", "y", "z"})
    test::device_of(rig, role)["config"].erase("acceleration_mm_s2");
  const test::TrialBench bench(test::short_recipe("denim"), rig);
  for (const char* role : {"x", "y", "z"}) {
    const Bytes& sent = bench.written.at(role);
    const Bytes velocity{0x13, 0x04, 0x0E, 0x00, 0xD0, 0x01};  // MGMSG_MOT_SET_VELPARAMS, APT16
    const auto at = std::ranges::search(sent, velocity).begin();
    REQUIRE(sent.end() - at >= 20);
    const auto byte = [&](int i) { return std::uint32_t{at[12 + i]}; };
    CHECK((byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24) == 10 * 4506);
  }
}

}  // namespace rig_file_test
