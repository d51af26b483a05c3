#include "sim/devices/rdt_emulator.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "sim/devices/netft_command_emulator.hpp"
#include "sim/devices/netft_page_emulator.hpp"
#include "tests/unit/sim/support.hpp"

namespace rdt_emulator_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::protocols;
using test::hex;

namespace {

struct Box {
  explicit Box(RdtEmulatorParams params = {}) : world(world_params(), 1), box(params, world, 1) {}

  static WorldParams world_params() {
    WorldParams params;
    for (StageParams& stage : params.stages)
      stage = {.low = 0, .high = 0.15, .start = 0.075, .quantum = 0, .backlash = 0};
    for (const std::size_t rotary : {3U, 4U})
      params.stages[rotary] = {.low = -1, .high = 1, .start = 0, .quantum = 0, .backlash = 0};
    params.plant.geometry.plate_z_m = 0.1;
    params.plant.rig_tilt = 0;
    return params;
  }
  void send(const std::string& text) { box.receive(hex(text), now, sink); }
  void run(double seconds) {
    const TimePoint end = now + from_seconds(seconds);
    for (auto at = box.next_wakeup(); at && *at <= end; at = box.next_wakeup())
      box.wake(now = std::max(*at, now), sink);
    now = end;
  }
  std::vector<rdt::Record> take() {
    std::vector<rdt::Record> records;
    for (const Bytes& datagram : datagrams)
      for (std::size_t at = 0; at + rdt::record_size <= datagram.size(); at += rdt::record_size)
        records.push_back(
            rdt::decode_record(ByteView(datagram).subspan(at, rdt::record_size)).value());
    datagrams.clear();
    return records;
  }

  std::vector<Bytes> datagrams;
  ByteSink sink = [this](ByteView b) { datagrams.emplace_back(b.begin(), b.end()); };
  TimePoint now{};
  BenchWorld world;
  RdtEmulator box;
};

const std::string start = "12 34 00 02 00 00 00 00";

}  // namespace

TEST_CASE("the box streams at its rate from start to stop") {
  for (const double rate : {1.0, 37.0, 100.0, 7000.0}) {
    RdtEmulatorParams params;
    params.rate_hz = rate;
    Box box(params);
    box.run(0.3);
    CHECK(box.take().empty());
    box.send(start);
    box.run(2 - 1e-6);
    const auto records = box.take();
    CHECK(records.size() == static_cast<std::size_t>(2 * rate));
    for (std::size_t i = 0; i < records.size(); ++i) REQUIRE(records[i].rdt_sequence == i + 1);
    box.send("12 34 00 00 00 00 00 00");
    box.run(2);
    CHECK(box.take().empty());
  }
}

TEST_CASE("a request for one sample gives one, a request for buffers gives full datagrams") {
  Box box;
  box.send("12 34 00 02 00 00 00 01");
  box.run(1);
  REQUIRE(box.datagrams.size() == 1);
  CHECK(box.datagrams[0].size() == 36);
  box.take();
  box.send("12 34 00 01 00 00 00 01");  // as ATI's own Java asks
  box.run(1);
  REQUIRE(box.datagrams.size() == 1);
  CHECK(box.datagrams[0].size() == 36);
  box.take();
  box.send("12 34 00 03 00 00 00 19");  // 25 records
  box.run(1);
  REQUIRE(box.datagrams.size() == 3);
  CHECK(box.datagrams[0].size() == 360);
  CHECK(box.datagrams[2].size() == 180);
}

TEST_CASE("the plate's weight reads before a bias and not after it; noise has its size") {
  Box box;
  box.send(start);
  box.run(1);
  double mean = 0;
  for (const auto& record : box.take()) mean += record.force_counts[2] / 100.0;
  CHECK(mean == Approx(0.3 * 9.80665e6).epsilon(0.01));
  box.send("12 34 00 42 00 00 00 00");
  CHECK(box.datagrams.empty());  // no reply
  box.run(20);
  double squares = 0, sum = 0;
  const auto records = box.take();
  for (const auto& record : records) {
    sum += record.force_counts[2];
    squares += std::pow(record.force_counts[2], 2);
    CHECK(record.status == 0);
    CHECK(record.force_counts[2] % 20000 == 0);  // the quantum of Fz
  }
  const double count = static_cast<double>(records.size());
  CHECK(sum / count == Approx(0).margin(30000));
  CHECK(std::sqrt(squares / count) < 40000);
}

TEST_CASE("pushing the plate down reads as plus Fz, and the torque is the arm times the force") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  params.sensor.plate_mass_kg = 0;
  params.sensor.centre_x_m = 0.05;  // the probe is at 0.075, 0.075
  params.sensor.centre_y_m = 0.085;
  Box box(params);
  box.world.stage(AxisId::z, box.now).move_to(0.1002, {0.01, 0.1}, box.now);
  box.send(start);
  box.run(6);
  const auto record = box.take().back();
  const double force = Mount{}.weight_n() + 0.0002 * Mount{}.stiffness_n_m;
  CHECK(record.force_counts[2] / 1e6 == Approx(force).margin(0.1));  // the plate gives 3 um
  CHECK(record.torque_counts[0] / 1e6 == Approx(-0.010 * force).margin(1.5e-3));
  CHECK(record.torque_counts[1] / 1e6 == Approx(-0.025 * force).margin(3e-3));
}

TEST_CASE("sliding drags the plate along the probe's way over it") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  box.world.stage(AxisId::z, box.now).move_to(0.1002, {0.01, 0.1}, box.now);
  box.run(5);
  box.world.stage(AxisId::y, box.now).move_to(0.1, {2e-3, 0.02}, box.now);
  box.send(start);
  box.run(3);
  const auto record = box.take().back();
  CHECK(record.force_counts[1] / 1e6 ==
        Approx(box.world.contact(box.now).friction_n[1]).margin(0.011));
  CHECK(record.force_counts[1] > 500000);
  CHECK(std::abs(record.force_counts[0]) <= 10000);
}

TEST_CASE("a load over the range is held there and flagged") {
  Box box;
  box.world.stage(AxisId::z, box.now).move_to(0.11, {0.01, 0.1}, box.now);
  box.send(start);
  box.run(10);
  const auto record = box.take().back();
  CHECK(record.force_counts[2] == 120000000);
  CHECK(record.status == (rdt::status::summary | rdt::status::saturation));
  CHECK_FALSE(rdt::values_valid(record.status));
}

TEST_CASE("what is no request is ignored and counted") {
  Box box;
  for (const char* bad : {"", "12", "12 34 00 02 00 00 00", "12 34 00 02 00 00 00 00 00",
                          "43 21 00 02 00 00 00 00", "12 34 00 99 00 00 00 00"})
    box.send(bad);
  box.run(1);
  CHECK(box.datagrams.empty());
  CHECK(box.box.ignored() == 6);
  box.send("12 34 00 41 00 00 00 00");
  CHECK(box.box.ignored() == 6);
}

TEST_CASE("a stream for several units is of this one, a record a datagram") {
  Box box;
  box.send("12 34 00 04 00 00 00 03");
  box.run(1);
  CHECK(box.datagrams.size() == 3);
  CHECK(box.take().size() == 3);
}

namespace {

/// A browser at the box's HTTP port.
struct Browser {
  Box& box;

  std::string ask(const std::string& text) {
    NetftPageEmulator page([&] { return &box.box; });
    std::string reply;
    ByteSink sink = [&](ByteView bytes) { reply.append(bytes.begin(), bytes.end()); };
    page.receive(ByteView(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), box.now,
                 sink);
    return reply;
  }
  std::string get(const std::string& path) {
    return ask("GET " + path + " HTTP/1.1\r\nHost: box\r\n\r\n");
  }
  bool shows(const std::string& element, const std::string& page = "/netftapi2.xml") {
    return get(page).find(element) != std::string::npos;
  }
};

}  // namespace

TEST_CASE("the box's web pages set what they show") {
  RdtEmulatorParams params;
  params.torque_unit = "Nm";
  params.calibration_serial = "FT12345";
  Box box(params);
  Browser browser{box};
  const auto ask = [&](const std::string& text) { return browser.ask(text); };
  const auto get = [&](const std::string& path) { return browser.get(path); };
  const auto shows = [&](const std::string& element) { return browser.shows(element); };
  CHECK(shows("<scfgtu>Nm</scfgtu>"));
  CHECK(shows("<cfgcalsn>FT12345</cfgcalsn>"));
  CHECK(shows("<setuserfilter>0</setuserfilter>"));
  get("/setting.cgi?setuserfilter=4");
  CHECK(shows("<setuserfilter>4</setuserfilter>"));
  get("/setting.cgi?setuserfilter=99");
  CHECK(shows("<setuserfilter>4</setuserfilter>"));

  box.send("12 34 00 42 00 00 00 00");
  CHECK_FALSE(shows("<setbias>0;0;0;0;0;0</setbias>"));
  for (const char* each : {"0", "1", "2", "3", "4"})
    get("/setting.cgi?setbias" + std::string(each) + "=0");
  CHECK(shows("<setbias>0;0;0;0;0;"));
  CHECK_FALSE(shows("<setbias>0;0;0;0;0;0</setbias>"));
  get("/setting.cgi?setbias5=0");
  CHECK(shows("<setbias>0;0;0;0;0;0</setbias>"));
  get("/setting.cgi?setbias0=-7000&setbias2=3000000");
  CHECK(shows("<setbias>-7000;0;3000000;0;0;0</setbias>"));
  const auto biased = box.box.page(box.now).counts;
  CHECK(std::abs(biased[2]) < 0.1e6);  // the plate weighs 2.9 N

  get("/comm.cgi?comrdtrate=250&comrdtbsiz=4");
  CHECK(shows("<comrdtrate>250</comrdtrate>"));
  CHECK(shows("<comrdtbsiz>4</comrdtbsiz>"));
  box.send("12 34 00 03 00 00 00 08");
  box.run(1);
  CHECK(box.datagrams.size() == 2);
  CHECK(box.take().size() == 8);
  get("/comm.cgi?comrdtrate=300");  // every 23rd of 7000 conversions
  CHECK(shows("<comrdtrate>304</comrdtrate>"));
  box.send(start);
  box.run(1);
  const auto records = box.take();
  CHECK(records.size() == 305);
  const auto conversions = static_cast<int>(records[304].ft_sequence - records[0].ft_sequence);
  CHECK(std::abs(conversions - 304 * 23) <= 1);
  get("/comm.cgi?comrdtrate=7000");  // of the next stream
  box.run(0.1);
  CHECK(box.take().size() < 35);
  box.send("12 34 00 00 00 00 00 00");
  get("/comm.cgi?comrdte=0");
  CHECK(shows("<comrdte>Disabled</comrdte>"));
  box.send(start);
  box.run(1);
  CHECK(box.take().empty());

  const std::string whole = get("/"), head = ask("HEAD / HTTP/1.1\r\n\r\n");
  CHECK(head == whole.substr(0, whole.find("\r\n\r\n") + 4));
  CHECK(ask("GET / HTTP/1.0\n\n").starts_with("HTTP/1.1 200"));
}

TEST_CASE("a box has sixteen configurations, of which the active one counts") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  params.sensor.quantum = {};
  Box box(params);
  Browser browser{box};
  CHECK(browser.shows("<scfgtu>N-m</scfgtu>"));
  CHECK(browser.shows("<scaltu>N-m</scaltu>", "/netftcalapi.xml"));
  CHECK(browser.shows("<calmr>40;40;120;2;2;2</calmr>", "/netftcalapi.xml"));
  const auto down = box.box.page(box.now).counts;
  browser.get("/config.cgi?cfgid=3&cfgnam=a%3Cb+c&cfgfu=1&cfgtu=4&cfgtfx0=100&cfgtfx3=90&cfgtdu=3");
  CHECK_FALSE(browser.shows("<cfgfu>1</cfgfu>"));
  const std::string third = "/netftapi2.xml?index=3";
  CHECK(browser.shows("<cfgnam>a&lt;b c</cfgnam>", third));
  CHECK(browser.shows("<cfgtfx>100;0;0;90;0;0</cfgtfx>", third));
  CHECK(browser.shows("<scfgfu>lbf</scfgfu>", third));
  CHECK(browser.shows("<scfgtu>N-mm</scfgtu>", third));
  CHECK(browser.shows("<cfgcpt>1000</cfgcpt>", third));
  CHECK(browser.shows("<cfgcpf>4448222</cfgcpf>", third));
  CHECK(box.box.page(box.now, 3).max_ratings[2] == Approx(26.977));  // 120 N in lbf
  CHECK(box.box.page(box.now).counts == down);
  browser.get("/setting.cgi?setcfgsel=3");
  CHECK(browser.shows("<setcfgsel>3</setcfgsel>"));
  CHECK(box.box.page(box.now).counts[1] == Approx(down[2]));  // a quarter turn about x
  for (const char* refused : {"cfgid=16&cfgfu=2", "cfgfu=2", "cfgid=3&cfgfu=7", "cfgid=3&cfgfu=x",
                              "cfgid=3&cfgfu=2.5", "cfgid=3&cfgfu=3"})  // klbf: 4.4e9 counts
    browser.get("/config.cgi?" + std::string(refused));
  CHECK(browser.shows("<cfgfu>1</cfgfu>"));
  CHECK(browser.get("/nothing.cgi?x=1").starts_with("HTTP/1.1 404"));
  browser.get("/config.cgi?cfgid=3&cfgusra=a%00%FF%zz%3&cfgnam=" + std::string(40, 'n'));
  CHECK(browser.shows("<cfgusra>a??%zz%3</cfgusra>"));
  CHECK(browser.shows("<cfgnam>" + std::string(32, 'n') + "</cfgnam>"));
}

TEST_CASE("the box's page sets thresholds, and shows which were breached, and the peaks") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  Browser browser{box};
  CHECK(browser.shows("<mcx>-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1</mcx>"));
  // the plate weighs 2.9 N
  browser.get("/moncon.cgi?mce0=1&mcx0=2&mcc0=1&mcv0=2000000&mco0=5");
  browser.get("/moncon.cgi?mce1=1&mcx1=2&mcc1=-1&mcv1=2000000&mco1=8");
  browser.get("/moncon.cgi?mce2=0&mcx2=2&mcc2=1&mcv2=2000000&mco2=16");
  CHECK(browser.shows("<mcv>2000000;2000000;2000000;0;"));
  CHECK(browser.shows("<runmcl>0</runmcl>"));
  for (const char* refused :
       {"mcc0=0.5", "mcc0=0", "mcx0=-0.5", "mce0=0.2", "mcv0=12abc", "setmce=1e-300"})
    browser.get("/moncon.cgi?" + std::string(refused));
  CHECK(browser.shows("<mcc>1;-1;1;1;"));
  CHECK(browser.shows("<mcx>2;2;2;-1;"));
  CHECK(browser.shows("<mcv>2000000;2000000;2000000;0;"));
  CHECK(browser.shows("<runmcl>0</runmcl>"));
  browser.get("/moncon.cgi?setmce=1");
  CHECK(browser.shows("<runstat>0x80010000</runstat>"));
  CHECK(browser.shows("<runmcb>0x00000001</runmcb>"));
  CHECK(browser.shows("<runmco>0x05</runmco>"));
  CHECK(browser.shows("<runmcl>1</runmcl>"));
  browser.get("/moncon.cgi?setmce=0");
  box.send("12 34 00 41 00 00 00 00");
  CHECK(browser.shows("<runmcl>0</runmcl>"));
  CHECK(browser.shows("<runpkmx>0;0;0;0;0;0</runpkmx>"));
  browser.get("/setting.cgi?setpke=1");
  const auto counts = box.box.page(box.now).counts;
  CHECK(counts[2] > 2'900'000);
  CHECK(box.box.page(box.now).lowest_counts == counts);
  box.send("12 34 00 42 00 00 00 00");
  CHECK(box.box.page(box.now).lowest_counts[2] == 0);
  CHECK(box.box.page(box.now).highest_counts == counts);
  browser.get("/setting.cgi?setpke=0");
  browser.get("/setting.cgi?setpke=1");  // begins anew
  CHECK(box.box.page(box.now).highest_counts[2] == 0);
}

TEST_CASE("a force above the threshold latches until a request resets it; the values stay valid") {
  RdtEmulatorParams params;
  params.threshold_n = 2;  // the plate weighs 2.9 N
  Box box(params);
  box.send(start);
  box.run(0.1);
  CHECK(box.take().back().status == 0x80010000);
  CHECK(rdt::values_valid(0x80010000));
  box.send("12 34 00 42 00 00 00 00");  // biased: below it, but latched
  box.run(0.1);
  CHECK(box.take().back().status == 0x80010000);
  box.send("12 34 00 41 00 00 00 00");
  box.run(0.1);
  CHECK(box.take().back().status == 0);
}

namespace {

/// A client of the box's command port.
struct CommandPort {
  explicit CommandPort(Box& of) : box(of), port([this] { return &box.box; }) {}
  Bytes ask(const rdt::CommandRequest& request, std::size_t chunk = rdt::command_size) {
    Bytes bytes, reply;
    append(bytes, request);
    ByteSink out = [&](ByteView b) { reply.insert(reply.end(), b.begin(), b.end()); };
    for (std::size_t at = 0; at < bytes.size(); at += chunk)
      port.receive(ByteView(bytes).subspan(at, std::min(chunk, bytes.size() - at)), box.now, out);
    return reply;
  }
  /// N and N m, as a client computes them.
  std::array<double, 6> wrench(const rdt::ReadFt& read = {}) {
    const auto scale = rdt::decode_calibration_reply(ask(rdt::ReadCalibration{})).value();
    const auto reply = rdt::decode_ft_reply(ask(read)).value();
    std::array<double, 6> out{};
    for (std::size_t i = 0; i < 6; ++i)
      out[i] = 1.0 * reply.counts[i] * scale.scale[i] /
               (i < 3 ? scale.counts_per_force : scale.counts_per_torque);
    return out;
  }
  Box& box;
  NetftCommandEmulator port;
};

}  // namespace

TEST_CASE("the command port reads the wrench that the stream tells, in any chunking") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  CommandPort port(box);
  box.send(start);
  box.run(0.1);
  const rdt::Record record = box.take().back();
  const auto wrench = port.wrench();
  CHECK(wrench[2] == Approx(record.force_counts[2] / 1e6).margin(0.004));
  CHECK(wrench[2] > 2.8);
  for (const std::size_t chunk : {1U, 7U, 19U})
    CHECK(port.ask(rdt::ReadFt{}, chunk) == port.ask(rdt::ReadFt{}));
  CHECK(port.ask(rdt::ReadFt{}).size() == rdt::ft_reply_size);
}

TEST_CASE("READFT biases the box and clears its latch") {
  RdtEmulatorParams params;
  params.threshold_n = 2;
  Box box(params);
  CommandPort port(box);
  CHECK(rdt::decode_ft_reply(port.ask(rdt::ReadFt{})).value().status == 0x8001);
  CHECK(std::abs(port.wrench({.bias = true})[2]) < 0.1);
  CHECK(rdt::decode_ft_reply(port.ask(rdt::ReadFt{})).value().status == 0x8001);
  CHECK(rdt::decode_ft_reply(port.ask(rdt::ReadFt{.clear_latch = true})).value().status == 0);
  CHECK(std::abs(port.wrench()[2]) < 0.1);
}

TEST_CASE("a tool transform moves torques and turns the frame, on the stream too") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  params.sensor.quantum = {};
  Box box(params);
  CommandPort port(box);
  const auto sensed = port.wrench();
  const auto taken = hex("12 34 02 00"), refused = hex("12 34 02 01");
  // 100 mm along x: the weight along z then pulls about y, T' = T - d x F.
  CHECK(port.ask(rdt::WriteTransform{.hundredths = {10000, 0, 0, 0, 0, 0}}) == taken);
  CHECK(port.wrench()[4] == Approx(sensed[4] + 0.1 * sensed[2]).margin(0.001));
  // A quarter turn about x: what was along z is now along the new y.
  CHECK(port.ask(rdt::WriteTransform{.hundredths = {0, 0, 0, 9000, 0, 0}}) == taken);
  CHECK(port.wrench()[1] == Approx(sensed[2]).margin(0.005));
  CHECK(std::abs(port.wrench()[2]) < 0.005);
  box.send(start);
  box.run(0.1);
  CHECK(box.take().back().force_counts[1] == Approx(sensed[2] * 1e6).epsilon(0.01));
  CHECK(box.box.page(box.now).configuration.tool_transform[3] == 90);
  CHECK(port.ask(rdt::WriteTransform{.distance_unit = 9}) == refused);
  CHECK(port.ask(rdt::WriteTransform{}) == taken);
  CHECK(port.wrench()[2] == Approx(sensed[2]).margin(0.005));
}

TEST_CASE("a condition that is written latches once a READFT has enabled it") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  CommandPort port(box);
  const auto scale = rdt::decode_calibration_reply(port.ask(rdt::ReadCalibration{})).value();
  const auto newtons = [&](double n) {
    return static_cast<std::int16_t>(n * scale.counts_per_force / scale.scale[2]);
  };
  const auto status = [&](const rdt::ReadFt& read) {
    return rdt::decode_ft_reply(port.ask(read)).value().status;
  };
  const auto taken = hex("12 34 03 00"), refused = hex("12 34 03 01");
  // the plate weighs 2.9 N
  CHECK(port.ask(rdt::WriteCondition{.index = 3, .axis = 2, .compared_with = newtons(2)}) == taken);
  CHECK(port.ask(rdt::WriteCondition{.index = 4, .axis = 2, .compared_with = newtons(4)}) == taken);
  CHECK(port.ask(rdt::WriteCondition{
            .index = 5, .axis = 2, .comparison = -1, .compared_with = newtons(4)}) == taken);
  CHECK(status({}) == 0);
  CHECK(status({.condition_mask = 1U << 4}) == 0);
  CHECK(status({.condition_mask = 1U << 3}) == 0x8001);
  CHECK(status({.condition_mask = 1U << 4}) == 0x8001);  // latched
  CHECK(status({.condition_mask = 1U << 4, .clear_latch = true}) == 0);
  box.send(start);
  box.run(0.1);
  CHECK(box.take().back().status == 0);
  CHECK(status({.condition_mask = 1U << 5}) == 0x8001);
  box.run(0.1);
  CHECK(box.take().back().status == 0x80010000);
  CHECK(port.ask(rdt::WriteCondition{.index = 32}) == refused);
  CHECK(port.ask(rdt::WriteCondition{.axis = 6}) == refused);
  CHECK(port.ask(rdt::WriteCondition{.comparison = 0}) == refused);
}

TEST_CASE("the command port does not answer what it does not know") {
  Box box;
  CommandPort port(box);
  Bytes reply;
  ByteSink out = [&](ByteView b) { reply.insert(reply.end(), b.begin(), b.end()); };
  const Bytes unknown(rdt::command_size, 0x77);
  port.port.receive(unknown, box.now, out);
  CHECK(reply.empty());
  CHECK(port.ask(rdt::ReadFt{}).size() == rdt::ft_reply_size);
  NetftCommandEmulator off([] { return nullptr; });
  off.receive(Bytes(rdt::command_size, 0), box.now, out);
  CHECK(reply.empty());
}

}  // namespace rdt_emulator_test
