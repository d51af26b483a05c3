#include <catch2/catch.hpp>

#include "tests/unit/drivers/ati_digital_support.hpp"

namespace ati_digital_test {

using namespace weft;
using namespace weft::testing;
using Bench = DigitalBench;
using weft::drivers::stream_status_error;

TEST_CASE(
    "opening reads status and calibration, makes it active, and reports the identity of the "
    "sensor") {
  Bench bench;
  const Bytes reply = bench.open();
  CHECK(bench.driver->state() == DriverState::open);
  // the document's own frames, in the order of KIT's start-up
  const std::vector<Bytes> order{
      read_status,
      hex("0A 03 00 E3 00 40 B4 B7"),
      hex("0A 03 01 23 00 40 B5 77"),
      hex("0A 03 01 63 00 28 B5 4D"),
      unlock_request,
      hex("0A 10 00 00 00 06 0C 02 1F 02 2B 02 39 02 43 02 35 02 37 47 2D"),
      lock_request};
  std::size_t at = 0;
  for (const Bytes& frame : order) {
    const std::size_t found = position(reply, frame);
    CHECK(found < reply.size());
    CHECK(found >= at);
    at = found;
  }
  CHECK(bench.active_gain == calibration().gain);
  CHECK(bench.active_offset == calibration().offset);
  REQUIRE(bench.host.identities.size() == 1);
  CHECK(to_json(bench.host.identities[0]) ==
        R"({"reported":{"calibrated":"2019/05/07","calibration":"1","family":"DFT",)"
        R"("part_number":"SI-40-2","serial":"FT12288"},"scale":{"counts_per_n":1000000.0,)"
        R"("counts_per_nm":1000000.0,"sign_z":1.0}})");
  CHECK(bench.host.samples.empty());
}

TEST_CASE("the gauge matrix gives newtons, and the sign of z comes from the configuration") {
  Bench bench(R"({"sign_z": -1})");
  bench.held.matrix[0][1] = 500;
  bench.arm();
  bench.stream({1000, -2000, 3000, 100, 200, -300});
  CHECK(bench.last().force_n[0] == Approx(0));  // 1000 - 2000 / 2 mN
  CHECK(bench.last().force_n[1] == Approx(-2));
  CHECK(bench.last().force_n[2] == Approx(-3));
  CHECK(bench.last().torque_nm[0] == Approx(0.1));
  CHECK(bench.last().torque_nm[2] == Approx(-0.3));
  CHECK(bench.last().valid);
  CHECK(bench.last().status == 0);
}

TEST_CASE("records that come with the answer to the start are not lost") {
  Bench bench;
  bench.open();
  REQUIRE(bench.driver->arm());
  Bytes bytes = started;
  append(bytes, StreamRecord{{1, 0, 0, 0, 0, 0}, false});
  append(bytes, StreamRecord{{2, 0, 0, 0, 0, 0}, false});
  bytes.resize(bytes.size() - 3);
  bench.receive(bytes);
  CHECK(bench.driver->state() == DriverState::armed);
  CHECK(bench.host.samples.size() == 1);
  CHECK(bench.last().force_n[0] == Approx(1e-3));
}

TEST_CASE("a damaged record is counted as lost, and the frame is found again") {
  Bench bench;
  bench.arm();
  std::int16_t n = 0;
  const auto next = [&] { bench.stream({n, static_cast<std::int16_t>(7 * n), 3, 4, 5, ++n}); };
  for (int i = 0; i < 5; ++i) next();
  bench.receive(hex("11 22 33 44 55 66 77 88 99 AA BB CC DD EE 12 34 56 78 9A BC"));
  for (int i = 0; i < 10; ++i) next();
  REQUIRE(bench.host.samples.size() == 15);
  CHECK(bench.host.samples[5].lost == 2);  // 20 bytes are 1.5 records
  CHECK(bench.host.samples[5].sequence == bench.host.samples[4].sequence + 3);
  CHECK(bench.host.samples[14].lost == 0);
  CHECK(bench.host.logs.size() == 1);
  CHECK(bench.driver->state() == DriverState::armed);
}

TEST_CASE("a sample may be the mean of several records, and what is lost is counted in samples") {
  Bench bench(R"({"average": 4})");
  bench.open();
  REQUIRE(bench.driver->arm());
  bench.receive(started);
  for (std::int16_t i = 0; i < 12; ++i) bench.stream({i, 0, 0, 0, 0, 0});
  REQUIRE(bench.host.samples.size() == 3);
  CHECK(bench.last().force_n[0] == Approx((8 + 9 + 10 + 11) / 4e3));
  CHECK(bench.host.samples[2].sequence == 3);
}

TEST_CASE("values are invalid beyond the rating, at the converter's rails and with the error bit") {
  Bench bench;
  bench.arm();
  bench.stream({0, 0, 30000, 0, 0, 0});
  CHECK(bench.last().valid);  // 30 of 120 N
  bench.stream({0, 0, 0, 2001, 0, 0});
  CHECK_FALSE(bench.last().valid);  // 2.001 of 2 N m
  bench.stream({0, 0, 32767, 0, 0, 0});
  CHECK_FALSE(bench.last().valid);
  bench.stream({0, 0, 1, 0, 0, 0}, true);
  CHECK_FALSE(bench.last().valid);
  CHECK(bench.last().status == stream_status_error);
  bench.stream({0, 0, 1, 0, 0, 0});
  CHECK(bench.last().valid);
  CHECK(bench.driver->state() == DriverState::armed);
  CHECK(bench.host.logs.size() == 2);  // once per episode
}

TEST_CASE("a bias makes the present reading zero, and the rating still means the whole load") {
  Bench bench;
  CHECK(bench.driver->command(BiasCommand{}).error().code == Errc::wrong_state);
  bench.arm();
  bench.stream({39000 - 32768, 0, 0, 0, 0, 0});
  bench.stream({20000, 0, 0, 0, 0, 0});
  CHECK(bench.driver->command(BiasCommand{}).value() == 0);
  CHECK(bench.host.link_.take_written().empty());  // the sensor has no bias command
  bench.stream({20000, 0, 0, 0, 0, 0});
  CHECK(bench.last().force_n[0] == Approx(0));
  bench.stream({30000, 0, 0, 0, 0, 0});
  CHECK(bench.last().force_n[0] == Approx(10));
  CHECK(bench.last().valid);
  CHECK(bench.driver->command(MoveCommand{}).error().code == Errc::unsupported);
}

}  // namespace ati_digital_test
