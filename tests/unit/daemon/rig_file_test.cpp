// What a rig file must not promise, and the provenance that a bench gives itself.

#include <nlohmann/json.hpp>

#include "tests/unit/daemon/trial_bench.hpp"

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

TEST_CASE("a bench that this version cannot run is refused, not run in memory") {
  for (const std::string kind : {"emulated", "real"}) {
    json rig = test::bench17();
    rig["bench"] = kind;
    const Error error = refusal(rig);
    CHECK(error.code == Errc::unsupported);
    CHECK(error.where == "/bench");
    CHECK(error.expected == "simulated");
    CHECK(error.got == kind);
    CHECK_FALSE(error.hint.empty());
  }
  json rig = test::bench17();
  rig["bench"] = "imaginary";
  CHECK(refusal(rig).code == Errc::invalid_argument);
}

TEST_CASE("a link that is not in memory is refused at its JSON pointer") {
  for (const std::string kind : {"serial", "udp", "tcp", "pty", "Memory", ""}) {
    json rig = test::bench17();
    rig["devices"][5]["link"]["kind"] = kind;
    const Error error = refusal(rig);
    CHECK(error.code == Errc::unsupported);
    CHECK(error.where == "/devices/5/link/kind");
    CHECK(error.got == kind);
  }
  json rig = test::bench17();
  rig["devices"][5]["link"] = json{{"port", "/dev/ttyUSB0"}};  // no kind
  CHECK(refusal(rig).where == "/devices/5/link/kind");
  rig["devices"][5]["link"] = "memory";
  CHECK(refusal(rig).where == "/devices/5/link");
  rig["devices"][5]["link"] = json{{"kind", "memory"}, {"port", 1}};
  CHECK(refusal(rig).where == "/devices/5/link/port");
  rig["devices"][5].erase("link");
  CHECK(parse_rig_file(rig.dump()));
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
