// The doctor's findings from given facts, without reading the machine.

#include "daemon/campaign/diagnostics/doctor.hpp"

#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace doctor_test {

using namespace weft;
using namespace weft::daemon;
using weft::daemon::test::TemporaryFolder;

namespace {

MachineFacts good_machine() {
  MachineFacts facts;
  facts.fifo_permitted = facts.memory_lockable = facts.folder_writable = true;
  facts.clock_resolution_ns = 1;
  facts.clock_synchronised = true;
  facts.governors = {"performance", "performance"};
  facts.free_bytes = 50'000'000'000;
  facts.software = "0.1.0+g0123456789ab";
  return facts;
}

const Diagnosis& about(const std::vector<Diagnosis>& found_problems, const std::string& subject) {
  for (const Diagnosis& diagnosis : found_problems)
    if (diagnosis.subject == subject) return diagnosis;
  FAIL("nothing about " << subject);
  return found_problems.front();
}

/// Expects a finding about `subject` with this text, and with `hint` unless it is ok.
void expect(const MachineFacts& facts, const std::string& subject, Severity severity,
            const std::string& says, const std::string& hint = {}) {
  const auto found_problems = check_system(facts, true);
  const Diagnosis& diagnosis = about(found_problems, subject);
  CAPTURE(subject, diagnosis.what, diagnosis.hint);
  CHECK(diagnosis.severity == severity);
  CHECK(diagnosis.what.find(says) != std::string::npos);
  CHECK(diagnosis.hint.find(hint) != std::string::npos);
  CHECK(diagnosis.hint.empty() == (severity == Severity::ok));
}

DeviceReport stream(double rate_hz, double configured_rate_hz) {
  DeviceReport report;
  report.name = "ft";
  report.driver = "ati_netft";
  report.answered = report.armed = true;
  report.samples = 100;
  report.rate_hz = rate_hz;
  report.configured_rate_hz = configured_rate_hz;
  return report;
}

Severity worst(const std::vector<Diagnosis>& found_problems) {
  Severity severity = Severity::ok;
  for (const Diagnosis& diagnosis : found_problems)
    severity = std::max(severity, diagnosis.severity);
  return severity;
}

void put(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << text << "\n";
}

}  // namespace

TEST_CASE("a machine that is in order has nothing but ok findings") {
  for (const Diagnosis& diagnosis : check_system(good_machine(), true)) {
    CAPTURE(diagnosis.subject, diagnosis.what);
    CHECK(diagnosis.severity == Severity::ok);
    CHECK(diagnosis.hint.empty());
  }
}

TEST_CASE("what a machine lacks is reported with a hint") {
  MachineFacts facts = good_machine();
  facts.fifo_permitted = facts.memory_lockable = false;
  facts.clock_resolution_ns = 4'000'000;
  facts.clock_synchronised = false;
  facts.governors = {"performance", "powersave"};
  facts.free_bytes = 500'000'000;
  expect(facts, "scheduling", Severity::warning, "SCHED_FIFO", "rtprio");
  expect(facts, "memory", Severity::warning, "locked", "memlock unlimited");
  expect(facts, "clock", Severity::warning, "4000000 ns", "kernel");
  expect(facts, "wall clock", Severity::warning, "not synchronised", "timedatectl");
  expect(facts, "processor", Severity::warning, "powersave", "cpupower");
  expect(facts, "disk", Severity::warning, "500 MB", "space");
  facts.software += ".modified";
  expect(facts, "software", Severity::warning, "+g0123456789ab.modified", "Commit");
  facts.free_bytes = 5'000'000;
  expect(facts, "disk", Severity::problem, "5 MB", "space");
  facts.folder_writable = false;
  expect(facts, "disk", Severity::problem, "not writable", "--out");
  facts.free_bytes.reset();
  expect(facts, "disk", Severity::problem, "not found", "--out");
}

TEST_CASE("in virtual time only the room for the data matters") {
  MachineFacts facts = good_machine();
  facts.fifo_permitted = false;
  facts.governors = {"powersave"};
  CHECK(worst(check_system(facts, false)) == Severity::ok);
  facts.free_bytes = 1;
  CHECK(worst(check_system(facts, false)) == Severity::problem);
}

TEST_CASE("a stream's rate is compared with the configured one") {
  CHECK(worst(check_devices({stream(99, 100)})) == Severity::ok);
  CHECK(worst(check_devices({stream(91, 100)})) == Severity::warning);
  CHECK(worst(check_devices({stream(50, 100)})) == Severity::problem);
  CHECK(worst(check_devices({stream(700, 100)})) == Severity::problem);
  DeviceReport lossy = stream(100, 100);
  lossy.lost = 3;
  CHECK(worst(check_devices({lossy})) == Severity::warning);
  DeviceReport silent = stream(0, 100);
  silent.samples = 0;
  CHECK(worst(check_devices({silent})) == Severity::problem);
}

TEST_CASE("a slow answer is a warning, a failure is a problem with its hint taken along") {
  DeviceReport stage = stream(0, 0);
  stage.latency_s = 0.002;
  CHECK(worst(check_devices({stage})) == Severity::ok);
  stage.latency_s = 0.03;
  CHECK(worst(check_devices({stage})) == Severity::warning);
  stage.answered = stage.armed = false;
  stage.error = Error{.code = Errc::timeout,
                      .where = "stage.x",
                      .what = "no answer",
                      .expected = "one",
                      .got = "silence",
                      .hint = "Is it on"};
  const auto found_problems = check_devices({stage});
  REQUIRE(found_problems.size() == 1);
  CHECK(found_problems.front().severity == Severity::problem);
  CHECK(found_problems.front().what.find("no answer") != std::string::npos);
  CHECK(found_problems.front().what.find("Is it on") == std::string::npos);
  CHECK(found_problems.front().hint == "Is it on");
}

TEST_CASE("one device behind two entries is seen by its serial number") {
  DeviceReport first = stream(100, 100);
  first.identity.reported = {{"serial", "45000001"}};
  DeviceReport second = first;
  second.name = "other";
  CHECK(worst(check_devices({first, second})) == Severity::problem);
  second.identity.reported = {{"serial", "45000002"}};
  CHECK(worst(check_devices({first, second})) == Severity::ok);
}

TEST_CASE("USB identities are named, Thorlabs' own by both its numbers") {
  CHECK(usb_note(0x0403, 0xFAF0) == "Thorlabs controller");
  CHECK(usb_note(0x0403, 0x6001) == "FTDI chip");
  CHECK(usb_note(0x2341, 0x0043) == "Arduino");
  CHECK(usb_note(0xDEAD, 0xFAF0).empty());
}

TEST_CASE("a Thorlabs controller without a serial port is found in the USB tree") {
  const TemporaryFolder usb;
  put(usb / "1-1/idVendor", "0403");
  put(usb / "1-1/idProduct", "faf0");
  put(usb / "1-1/serial", "45000001");
  put(usb / "1-1/1-1:1.0/ttyUSB0/dev", "188:0");
  put(usb / "1-2/idVendor", "0403");
  put(usb / "1-2/idProduct", "faf0");
  put(usb / "1-2/serial", "45000002");
  put(usb / "1-3/idVendor", "0403");
  put(usb / "1-3/idProduct", "6001");
  CHECK(thorlabs_without_port(usb.path()) == std::vector<std::string>{"45000002"});
  CHECK(thorlabs_without_port("/nowhere").empty());
}

TEST_CASE("an impossible serial port is reported before it is opened") {
  const TemporaryFolder folder;
  put(folder / "file", "no port");
  const auto problem = [](const std::string& path) {
    const auto found_problems =
        check_serial("stage.x", {path, 115200, Parity::none, false, false},
                     {{"/dev/ttyUSB7", "", 0x0403, 0xFAF0, "45000001", "Thorlabs controller"}});
    REQUIRE(found_problems.size() == 1);
    CHECK(found_problems.front().severity == Severity::problem);
    CHECK(found_problems.front().subject == "stage.x");
    return found_problems.front();
  };
  CHECK(problem("/dev/ttyNobody").hint.find("/dev/ttyUSB7 (Thorlabs controller)") !=
        std::string::npos);
  CHECK(problem(folder / "file").what.find((folder / "file").string()) != std::string::npos);
  CHECK(problem(folder / "file").hint.find("/dev/serial/by-id") != std::string::npos);
  CHECK(check_serial("stage.x", {"/dev/null", 115200, Parity::none, false, false}, {}).size() <= 1);
}

TEST_CASE("two devices on one serial port are reported once, however the path is written") {
  const TemporaryFolder folder;
  put(folder / "port", "");
  std::filesystem::create_symlink(folder / "port", folder / "by-id");
  const auto device = [&](const std::string& name, const std::string& port) {
    DeviceEntry entry;
    entry.name = name;
    entry.link = SerialSettings{folder / port, 115200, Parity::none, false, false};
    return entry;
  };
  const auto found_problems =
      shared_ports({device("first", "port"), device("second", "by-id"), device("third", "other")});
  REQUIRE(found_problems.size() == 1);
  CHECK(found_problems.front().subject == "second");
  CHECK(found_problems.front().what.find("first") != std::string::npos);
}

TEST_CASE("a stage on a controller with an unknown scale for it is a problem by name") {
  const TemporaryFolder folder;
  nlohmann::json rig = test::bench17();
  nlohmann::json& z = test::device_of(rig, "z");
  z["config"]["stage"] = z["emulator"]["stage"] = "NRT150";
  z["emulator"]["model"] = "BSC101";
  test::write_file(folder / "rig.json", rig.dump());
  const std::string path = (folder / "rig.json").string();
  std::ostringstream out, err;
  cli::Console console{out, err};
  const char* arguments[] = {"weft", "doctor", "--rig", path.c_str(), "--listen", "1"};
  CHECK(cli::run(6, arguments, console) == cli::exit_failure);
  CHECK_THAT(out.str(), Catch::Contains("NRT150") && Catch::Contains("BSC101"));
}

}  // namespace doctor_test
