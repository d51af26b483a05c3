#include "sim/devices/rdt_emulator.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/unit/sim/support.hpp"

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
  for (const char* bad :
       {"", "12", "12 34 00 02 00 00 00", "12 34 00 02 00 00 00 00 00", "43 21 00 02 00 00 00 00",
        "12 34 00 99 00 00 00 00", "12 34 00 04 00 00 00 00"})
    box.send(bad);
  box.run(1);
  CHECK(box.datagrams.empty());
  CHECK(box.box.ignored() == 7);
  box.send("12 34 00 41 00 00 00 00");
  CHECK(box.box.ignored() == 7);
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
