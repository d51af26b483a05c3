// Roles of devices, missing parts of a rig, numbers that must not be guessed, the rig file.
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/campaign/setup/port_identifier.hpp"
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
  out.is_expected = true;  // as if it were named
  return out;
}

/// Sets the values without a default on a real bench.
void measure(RigDraft& draft) {
  for (const auto& [name, value] : {std::pair("surface_z_mm", 60.0),
                                    {"probe_mass_kg", 0.2},
                                    {"force_cap_n", 6.0},
                                    {"torque_cap_nm", 2.0},
                                    {"counts_per_newton", 1e6},
                                    {"counts_per_newton_metre", 1e6},
                                    {"taxel_cap_counts", 8000.0},
                                    {"press_depth_mm", 2.0},
                                    {"touch_counts", 20.0}})
    REQUIRE(set_number(draft, name, value));
}

/// As a user may state them.
void state_roles(RigDraft& draft) {
  for (DraftDevice& device : draft.devices) device.is_role_stated = true;
}

std::vector<std::string> places(const std::vector<Error>& errors) {
  std::vector<std::string> out;
  for (const Error& error : errors) out.push_back(error.where);
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

struct Folder {
  explicit Folder(const char* pattern) {
    std::string name = (fs::temp_directory_path() / pattern).string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    path = name;
  }
  ~Folder() { fs::remove_all(path); }
  fs::path path;
};

/// A real bench of two linear stages and a force sensor, with all values stated.
RigDraft real_xz() {
  RigDraft draft = draft_of("bench", BenchMode::real,
                            {stage("LTS150", "45000001"), stage("LTS150", "45000002"),
                             sensor(DeviceKind::net_ft, "192.168.1.1", 500)});
  measure(draft);
  state_roles(draft);
  return draft;
}

/// Within its lifetime the working folder is that of the recipe library and the tables of the
/// simulation.
struct InSourceTree {
  InSourceTree() { fs::current_path(WEFT_SOURCE_DIR); }
  ~InSourceTree() { fs::current_path(before); }
  fs::path before = fs::current_path();
};

/// For this thread link(2) fails, like on a file system without links.
void forbid_links() {
  constexpr auto number = static_cast<std::uint32_t>(offsetof(seccomp_data, nr));
  std::vector<sock_filter> rules{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, number)};
  for (const std::uint32_t call : {
#ifdef SYS_link
           std::uint32_t{SYS_link},
#endif
           std::uint32_t{SYS_linkat}}) {
    rules.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1));
    rules.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  }
  rules.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  sock_fprog program{static_cast<unsigned short>(rules.size()), rules.data()};
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
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
  CHECK(draft.with_role("x")->found.serial == "27000001");  // by serial numbers, not models
  CHECK(draft.with_role("x")->stage == "MTS25-Z8");
  state_roles(draft);
  measure(draft);
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
  state_roles(draft);
  measure(draft);
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

TEST_CASE("All missing parts are reported") {
  RigDraft draft = draft_of("bench", BenchMode::real, {stage("LTS150", "45000001")});
  measure(draft);
  CHECK(draft.with_role("z") != nullptr);
  CHECK(missing_parts(draft).size() == 3);  // x, a sensor, and the motion of this stage
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
  CHECK(rounded_rate_hz(std::numeric_limits<double>::infinity()) == 0);  // a stopped clock
}

TEST_CASE("A rig file is never written over another one, and not where it would be refused") {
  const Folder folder("weft-init-XXXXXX");
  RigDraft draft = real_xz();
  const fs::path rig = folder.path / "rig.json";
  REQUIRE(write_rig(draft, rig));
  CHECK(write_rig(draft, rig).error().code == Errc::wrong_state);
  CHECK(require_new_file(rig).error().code == Errc::wrong_state);
  draft.devices[0].found.destination = 0x05;  // not an address of a unit
  CHECK_FALSE(write_rig(draft, folder.path / "bad.json"));
  CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);  // no other file remains
}

TEST_CASE("A rig file is written where the file system has no hard links") {
  const Folder folder("weft-init-XXXXXX");
  const RigDraft draft = real_xz();
  bool is_refused = false;
  Status written;
  std::thread([&] {
    forbid_links();
    is_refused = ::link("/dev/null", (folder.path / "link").c_str()) != 0 && errno == EPERM;
    written = write_rig(draft, folder.path / "rig.json");
  }).join();
  REQUIRE(is_refused);
  REQUIRE(written);
  CHECK(fs::file_size(folder.path / "rig.json") == rig_text(draft)->size());
}

TEST_CASE("A real bench has no default for what does harm, and z ends below the plate") {
  RigDraft draft = real_xz();
  draft.answers.clear();
  CHECK(places(missing_parts(draft)) ==
        std::vector<std::string>{"surface_z_mm", "probe_mass_kg", "force_cap_n", "torque_cap_nm",
                                 "counts_per_newton", "counts_per_newton_metre"});
  draft.devices.back() = {};
  draft.devices.back().found = sensor(DeviceKind::taxel_array, "/dev/t", 37);
  REQUIRE(set_role(draft, "/dev/t", "taxels"));
  CHECK(places(missing_parts(draft)) == std::vector<std::string>{"surface_z_mm", "probe_mass_kg",
                                                                 "taxel_cap_counts",
                                                                 "press_depth_mm", "touch_counts"});
  draft.mode = BenchMode::emulated;
  CHECK(missing_parts(draft).empty());

  const json rig = written(real_xz());
  CHECK(rig["limits"]["travel_mm"] == json{{"x", {0, 150}}, {"z", {0, 65}}});
  CHECK(rig["devices"][1]["config"]["travel_mm"] == json{0, 65});
  draft = real_xz();
  REQUIRE(set_number(draft, "surface_z_mm", 148));
  CHECK(written(draft)["limits"]["travel_mm"]["z"] == json{0, 150});
}

TEST_CASE("The scale of a box with unread pages is the stated one") {
  RigDraft draft = real_xz();
  REQUIRE(set_number(draft, "counts_per_newton", 224809));
  const json rig = written(draft);
  CHECK(rig["devices"][2]["config"]["counts_per_newton"] == 224809);
  CHECK(rig["devices"][2]["config"]["counts_per_newton_metre"] == 1e6);
}

TEST_CASE("Answers that no bench could take are refused before a device is known") {
  const auto place = [](const char* answers) { return check_answers(answers).error().where; };
  CHECK(check_answers(R"({"roles": {"/dev/a": "x", "/dev/b": "none"}, "force_cap_n": 6})"));
  CHECK(place(R"({"roles": {"/dev/a": "None"}})") == "/roles/~1dev~1a");
  CHECK(place(R"({"force_cap": 6})") == "force_cap");
  CHECK(place(R"({"touch_counts": 0.5})") == "touch_counts");
  CHECK(check_answers("[]").error().code == Errc::parse);
  CHECK(check_role_name("wrenches").error().code == Errc::invalid_argument);
}

TEST_CASE("A short stage has half of what is above its plate for the clearance") {
  const Folder folder("weft-init-XXXXXX");
  for (const auto& [controller, id, surface_mm] :
       {std::tuple("KDC101", 11, 2.4), {"KDC101", 10, 4.8}, {"TDC001", 11, 2.4}}) {
    RigDraft draft = draft_of(
        "bench", BenchMode::real,
        {stage("LTS150", "45000001"), stage(controller, "27000002", static_cast<std::uint16_t>(id)),
         sensor(DeviceKind::net_ft, "192.168.1.1", 500)});
    measure(draft);
    REQUIRE(set_role(draft, "27000002", "z"));
    REQUIRE(set_role(draft, "45000001", "x"));
    REQUIRE(set_number(draft, "surface_z_mm", surface_mm));
    CHECK(draft.number("clearance_mm") == surface_mm / 2);
    CHECK(write_rig(draft, folder.path / (std::to_string(id) + controller)));
  }
  CHECK(real_xz().number("clearance_mm") == 8);
}

TEST_CASE("On a real bench the roles of stages must be stated, also of a single rotary one") {
  const std::vector<FoundDevice> devices{stage("LTS150", "45000001"), stage("LTS150", "45000002"),
                                         stage("K10CR1", "55000001"),
                                         sensor(DeviceKind::net_ft, "192.168.1.1", 500)};
  RigDraft draft = draft_of("bench", BenchMode::real, devices);
  measure(draft);
  CHECK(places(missing_parts(draft)) ==
        std::vector<std::string>{"/dev/45000001", "/dev/45000002", "/dev/55000001"});
  REQUIRE(set_role(draft, "45000001", "z"));
  CHECK(role_of(draft, "45000002") == "x");  // the remaining role, still a guess
  CHECK(places(missing_parts(draft)) == std::vector<std::string>{"/dev/45000002", "/dev/55000001"});
  REQUIRE(set_role(draft, "45000002", "x"));
  REQUIRE(set_role(draft, "55000001", "ry"));
  CHECK(missing_parts(draft).empty());
  const auto assumed = assumed_roles(draft);
  REQUIRE(assumed.size() == 1);
  CHECK(assumed[0]->role == "wrench");
  draft = draft_of("bench", BenchMode::emulated, devices);
  CHECK(missing_parts(draft).empty());
}

TEST_CASE("On a real bench an unnamed box has no role unless one is stated") {
  std::vector<FoundDevice> devices{stage("LTS150", "45000001"), stage("LTS150", "45000002"),
                                   sensor(DeviceKind::net_ft, "192.168.1.1", 500)};
  devices.back().is_expected = false;  // found only by broadcast
  RigDraft draft = draft_of("bench", BenchMode::real, devices);
  CHECK_FALSE(draft.has_wrench());
  REQUIRE(set_role(draft, "192.168.1.1", "wrench"));
  CHECK(draft.has_wrench());
}

TEST_CASE("A stage that is stated has a role of its axis") {
  RigDraft draft =
      draft_of("bench", BenchMode::real,
               {stage("KDC101", "27000001"), stage("LTS150", "45000001"),
                stage("LTS150", "45000002"), sensor(DeviceKind::net_ft, "192.168.1.1", 500)});
  measure(draft);
  CHECK(role_of(draft, "27000001") == "none");  // linear or rotary is unknown
  CHECK(places(missing_parts(draft)).front() == "/dev/27000001");
  REQUIRE(set_stage(draft, "27000001", "PRM1-Z8"));
  CHECK(role_of(draft, "27000001") == "rx");
  CHECK(set_role(draft, "27000001", "x").error().code == Errc::invalid_argument);
  REQUIRE(set_stage(draft, "27000001", "MTS25-Z8"));
  CHECK(role_of(draft, "27000001") == "x");
  REQUIRE(set_role(draft, "27000001", "x"));
  REQUIRE(set_role(draft, "45000001", "y"));
  REQUIRE(set_role(draft, "45000002", "z"));
  CHECK(missing_parts(draft).empty());
  REQUIRE(set_stage(draft, "27000001", "PRM1-Z8"));  // its role was stated as x before
  CHECK(places(missing_parts(draft)) == std::vector<std::string>{"/dev/27000001"});
}

TEST_CASE("A device that is left out before the search needs no role") {
  RigDraft draft = real_xz();
  draft.left_out = {"/dev/ttyUSB9"};
  CHECK(set_role(draft, "/dev/ttyUSB9", "none"));
  CHECK(set_role(draft, "/dev/ttyUSB9", "x").error().code == Errc::not_found);
  CHECK(set_role(draft, "/dev/ttyUSB8", "none").error().code == Errc::not_found);
  CHECK(devices_without_role(R"({"roles": {"a": "none", "b": "x"}, "speed_mm_s": 3})") ==
        std::vector<std::string>{"a"});
}

TEST_CASE("The recipe that is suggested is one that the rig accepts, or there is none") {
  const InSourceTree library_is_here;
  const Folder folder("weft-init-XXXXXX");
  const auto suggested = [&](const RigDraft& draft, const char* name) {
    const Status done = write_rig(draft, folder.path / name);
    INFO((done ? std::string() : to_string(done.error())));
    REQUIRE(done);
    return fs::path(suitable_recipe(draft, folder.path / name)).filename().string();
  };
  CHECK(suggested(real_xz(), "no-taxels.json") == "");  // all recipes of the library train from
                                                        // taxels
  RigDraft along_x = real_xz();
  along_x.devices.emplace_back().found = sensor(DeviceKind::taxel_array, "/dev/t", 37);
  REQUIRE(set_role(along_x, "/dev/t", "taxels"));
  CHECK(suggested(along_x, "xz.json") == "first-along-x.json");
  FoundDevice imprint = sensor(DeviceKind::imprint_array, "/dev/i", 5);
  imprint.rows = imprint.cols = 32;
  RigDraft draft =
      draft_of("bench", BenchMode::emulated,
               {stage("LTS150", "45000001"), stage("LTS150", "45000002"),
                stage("LTS150", "45000003"), sensor(DeviceKind::net_ft, "b", 100), imprint});
  draft.console = {"127.0.0.1", 1};
  REQUIRE(set_number(draft, "force_cap_n", 60));
  CHECK(suggested(draft, "strong.json") == "imprint.json");
  REQUIRE(set_number(draft, "force_cap_n", 11));
  CHECK(suggested(draft, "imprint.json") != "imprint.json");
}

}  // namespace setup_test
