#include "sim/devices/rdt_emulator.hpp"

#include <cmath>

#include "tests/unit/sim/netft_box.hpp"

namespace rdt_emulator_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::protocols;
using test::Box;
using test::hex;
using test::start;

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
  box.send("12 34 00 01 00 00 00 01");  // like ATI's own Java client
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
  box.bench_plant.stage(AxisId::z, box.now).move_to(0.1002, {0.01, 0.1}, box.now);
  box.send(start);
  box.run(6);
  const auto record = box.take().back();
  const double force = Mount{}.weight_n() + 0.0002 * Mount{}.stiffness_n_m;
  CHECK(record.force_counts[2] / 1e6 == Approx(force).margin(0.1));  // the plate yields by 3 um
  CHECK(record.torque_counts[0] / 1e6 == Approx(-0.010 * force).margin(1.5e-3));
  CHECK(record.torque_counts[1] / 1e6 == Approx(-0.025 * force).margin(3e-3));
}

TEST_CASE("sliding drags the plate along the probe's way over it") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  box.bench_plant.stage(AxisId::z, box.now).move_to(0.1002, {0.01, 0.1}, box.now);
  box.run(5);
  box.bench_plant.stage(AxisId::y, box.now).move_to(0.1, {2e-3, 0.02}, box.now);
  box.send(start);
  box.run(3);
  const auto record = box.take().back();
  CHECK(record.force_counts[1] / 1e6 ==
        Approx(box.bench_plant.contact(box.now).friction_n[1]).margin(0.011));
  CHECK(record.force_counts[1] > 500000);
  CHECK(std::abs(record.force_counts[0]) <= 10000);
}

TEST_CASE("a load over the range is held there and flagged") {
  Box box;
  box.bench_plant.stage(AxisId::z, box.now).move_to(0.11, {0.01, 0.1}, box.now);
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

TEST_CASE("a force above the threshold latches until a request resets it; the values stay valid") {
  RdtEmulatorParams params;
  params.threshold_n = 2;  // the plate weighs 2.9 N
  Box box(params);
  box.send(start);
  box.run(0.1);
  CHECK(box.take().back().status == 0x80010000);
  CHECK(rdt::values_valid(0x80010000));
  box.send("12 34 00 42 00 00 00 00");  // biased: below the threshold, but latched
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
  Bytes query(const rdt::CommandRequest& request, std::size_t chunk = rdt::command_size) {
    Bytes bytes, reply;
    append(bytes, request);
    ByteSink out = [&](ByteView b) { reply.insert(reply.end(), b.begin(), b.end()); };
    for (std::size_t at = 0; at < bytes.size(); at += chunk)
      port.receive(ByteView(bytes).subspan(at, std::min(chunk, bytes.size() - at)), box.now, out);
    return reply;
  }
  /// Values in N and N m, as a client computes them.
  std::array<double, 6> wrench(const rdt::ReadFt& read = {}) {
    const auto scale = rdt::decode_calibration_reply(query(rdt::ReadCalibration{})).value();
    const auto reply = rdt::decode_ft_reply(query(read)).value();
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

TEST_CASE("the command port reads the wrench of the stream, in any chunking") {
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
    CHECK(port.query(rdt::ReadFt{}, chunk) == port.query(rdt::ReadFt{}));
  CHECK(port.query(rdt::ReadFt{}).size() == rdt::ft_reply_size);
}

TEST_CASE("READFT biases the box and clears its latch") {
  RdtEmulatorParams params;
  params.threshold_n = 2;
  Box box(params);
  CommandPort port(box);
  CHECK(rdt::decode_ft_reply(port.query(rdt::ReadFt{})).value().status == 0x8001);
  CHECK(std::abs(port.wrench({.bias = true})[2]) < 0.1);
  CHECK(rdt::decode_ft_reply(port.query(rdt::ReadFt{})).value().status == 0x8001);
  CHECK(rdt::decode_ft_reply(port.query(rdt::ReadFt{.clear_latch = true})).value().status == 0);
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
  // 100 mm along x: the weight along z then causes a torque about y, T' = T - d x F.
  CHECK(port.query(rdt::WriteTransform{.hundredths = {10000, 0, 0, 0, 0, 0}}) == taken);
  CHECK(port.wrench()[4] == Approx(sensed[4] + 0.1 * sensed[2]).margin(0.001));
  // A quarter turn about x: the old z direction is now the new y.
  CHECK(port.query(rdt::WriteTransform{.hundredths = {0, 0, 0, 9000, 0, 0}}) == taken);
  CHECK(port.wrench()[1] == Approx(sensed[2]).margin(0.005));
  CHECK(std::abs(port.wrench()[2]) < 0.005);
  box.send(start);
  box.run(0.1);
  CHECK(box.take().back().force_counts[1] == Approx(sensed[2] * 1e6).epsilon(0.01));
  CHECK(box.box.page(box.now).configuration.tool_transform[3] == 90);
  CHECK(port.query(rdt::WriteTransform{.distance_unit = 9}) == refused);
  CHECK(port.query(rdt::WriteTransform{}) == taken);
  CHECK(port.wrench()[2] == Approx(sensed[2]).margin(0.005));
}

TEST_CASE("a condition that is written latches once a READFT has enabled it") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  CommandPort port(box);
  const auto scale = rdt::decode_calibration_reply(port.query(rdt::ReadCalibration{})).value();
  const auto newtons = [&](double n) {
    return static_cast<std::int16_t>(n * scale.counts_per_force / scale.scale[2]);
  };
  const auto status = [&](const rdt::ReadFt& read) {
    return rdt::decode_ft_reply(port.query(read)).value().status;
  };
  const auto taken = hex("12 34 03 00"), refused = hex("12 34 03 01");
  // the plate weighs 2.9 N
  CHECK(port.query(rdt::WriteCondition{.index = 3, .axis = 2, .compared_with = newtons(2)}) ==
        taken);
  CHECK(port.query(rdt::WriteCondition{.index = 4, .axis = 2, .compared_with = newtons(4)}) ==
        taken);
  CHECK(port.query(rdt::WriteCondition{
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
  CHECK(port.query(rdt::WriteCondition{.index = 32}) == refused);
  CHECK(port.query(rdt::WriteCondition{.axis = 6}) == refused);
  CHECK(port.query(rdt::WriteCondition{.comparison = 0}) == refused);
}

TEST_CASE("the command port does not answer what it does not know") {
  Box box;
  CommandPort port(box);
  Bytes reply;
  ByteSink out = [&](ByteView b) { reply.insert(reply.end(), b.begin(), b.end()); };
  const Bytes unknown(rdt::command_size, 0x77);
  port.port.receive(unknown, box.now, out);
  CHECK(reply.empty());
  CHECK(port.query(rdt::ReadFt{}).size() == rdt::ft_reply_size);
  NetftCommandEmulator off([] { return nullptr; });
  off.receive(Bytes(rdt::command_size, 0), box.now, out);
  CHECK(reply.empty());
}

}  // namespace rdt_emulator_test
