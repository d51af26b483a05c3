#include <catch2/catch.hpp>
#include <memory>

#include "drivers/ati_netft/netft_driver.hpp"
#include "protocols/rdt/rdt.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace netft_test {

using namespace weft;
using namespace weft::testing;
namespace rdt = protocols::rdt;

namespace {

const Bytes one_sample = hex("12 34 00 02 00 00 00 01");
const Bytes start = hex("12 34 00 02 00 00 00 00");
const Bytes stop = hex("12 34 00 00 00 00 00 00");
// device-facts.md, Net F/T stream: sequence 1/2, Fx 1 N, Fy -0.5 N, Tz 0.1 N m at 1e6 counts
const Bytes documented_record =
    hex("00 00 00 01 00 00 00 02 00 00 00 00 00 0F 42 40 FF F8 5E E0 00 00 00 00 00 00 00 00 "
        "00 00 00 00 00 01 86 A0");

struct Bench : DriverBench {
  /// The scripts of most tests repeat one value forever.
  explicit Bench(const std::string& config = "{}")
      : DriverBench(drivers::ati_netft_entry, unwatched(config)) {}
  static std::string unwatched(std::string config) {
    const bool alone = config == "{}";
    return config.insert(1, alone ? R"("stuck_after_s": 0)" : R"("stuck_after_s": 0, )");
  }
  using DriverBench::receive;
  void receive(std::uint32_t sequence, std::int32_t fz_counts = 0, std::uint32_t status = 0) {
    Bytes datagram;
    append(datagram, rdt::Record{sequence, sequence, status, {0, 0, fz_counts}, {}});
    receive(datagram);
  }
  void arm() {
    REQUIRE(driver->open());
    receive(1);
    REQUIRE(driver->arm());
    receive(1);
    REQUIRE(driver->state() == DriverState::armed);
    host.samples.clear();
    host.link_.take_written();
  }
  const WrenchSample& last() const { return DriverBench::last<WrenchSample>(); }
};

}  // namespace

TEST_CASE("the sensor's identity is its scale: RDT reports no serial number") {
  Bench bench(R"({"counts_per_newton": 250000, "sign_z": -1})");
  REQUIRE(bench.driver->open());
  CHECK(bench.host.identities.empty());
  bench.receive(1);
  bench.receive(1);
  REQUIRE(bench.host.identities.size() == 1);
  const DeviceIdentity& identity = bench.host.identities[0];
  CHECK(identity.reported.empty());
  CHECK(
      to_json(identity) ==
      R"({"reported":{},"scale":{"counts_per_n":250000.0,"counts_per_nm":1000000.0,"sign_z":-1.0}})");
}

TEST_CASE("a slow stream is not stale before ten of its periods") {
  Bench bench(R"({"rate_hz": 5})");
  bench.arm();
  for (int i = 2; i < 12; ++i) {
    bench.host.loop_.run_for(0.2);
    bench.receive(static_cast<std::uint32_t>(i));
  }
  CHECK(bench.host.faults.empty());
  bench.host.loop_.run_for(2.1);
  CHECK(bench.fault_code() == Errc::timeout);
}

TEST_CASE("the sensor is opened with one sample, streams when armed, and publishes SI values") {
  Bench bench;
  REQUIRE(bench.driver->open());
  CHECK(bench.host.link_.take_written() == one_sample);
  bench.receive(documented_record);
  CHECK(bench.driver->state() == DriverState::open);
  CHECK(bench.host.samples.empty());
  REQUIRE(bench.driver->arm());
  CHECK(bench.host.link_.take_written() == start);
  CHECK(bench.driver->arm().error().code == Errc::wrong_state);  // already under way
  bench.receive(documented_record);
  CHECK(bench.host.states == std::vector{DriverState::open, DriverState::armed});
  REQUIRE(bench.host.samples.size() == 1);
  CHECK(bench.last().force_n[0] == Approx(1.0).epsilon(1e-12));
  CHECK(bench.last().force_n[1] == Approx(-0.5).epsilon(1e-12));
  CHECK(bench.last().torque_nm[2] == Approx(0.1).epsilon(1e-12));
  CHECK(bench.last().valid);
  CHECK(bench.host.samples[0].sequence == 1);
  CHECK(bench.host.samples[0].lost == 0);
}

TEST_CASE("counts per unit and the sign of z come from the configuration") {
  Bench bench(R"({"counts_per_newton": 1000, "counts_per_newton_metre": 500, "sign_z": -1})");
  bench.arm();
  Bytes datagram;
  append(datagram, rdt::Record{2, 2, 0, {1000, -2000, 3000}, {500, 0, -1000}});
  bench.receive(datagram);
  CHECK(bench.last().force_n[0] == Approx(1));
  CHECK(bench.last().force_n[1] == Approx(-2));
  CHECK(bench.last().force_n[2] == Approx(-3));
  CHECK(bench.last().torque_nm[0] == Approx(1));
  CHECK(bench.last().torque_nm[2] == Approx(-2));
}

TEST_CASE("gaps are counted, repeated and late records are dropped") {
  Bench bench;
  bench.arm();
  for (const std::uint32_t sequence : {2U, 3U, 6U, 6U, 5U, 7U}) bench.receive(sequence);
  std::vector<std::uint32_t> sequences;
  std::vector<std::uint32_t> lost;
  for (const Sample& sample : bench.host.samples) {
    sequences.push_back(sample.sequence);
    lost.push_back(sample.lost);
  }
  CHECK(sequences == std::vector<std::uint32_t>{2, 3, 6, 7});
  CHECK(lost == std::vector<std::uint32_t>{0, 0, 2, 0});
}

TEST_CASE("a datagram with several records gives as many samples") {
  Bench bench;
  bench.arm();
  Bytes datagram;
  for (std::uint32_t i = 2; i < 42; ++i) append(datagram, rdt::Record{i, i, 0, {}, {}});
  bench.receive(datagram);
  CHECK(bench.host.samples.size() == 40);
}

TEST_CASE("values are marked invalid by the status word and beyond the rating") {
  Bench bench(R"({"rated_force_n": [40, 40, 120]})");
  bench.arm();
  bench.receive(2, 5000000, 0x80010000);  // a threshold only
  CHECK(bench.last().valid);
  CHECK(bench.last().force_n[2] == Approx(5));
  bench.receive(3, 0, 0x80020000);  // saturation
  CHECK_FALSE(bench.last().valid);
  CHECK(bench.last().status == 0x80020000);
  bench.receive(4, 120000000);
  CHECK(bench.last().valid);
  bench.receive(5, 120000001);
  CHECK_FALSE(bench.last().valid);
  CHECK(bench.driver->state() == DriverState::armed);
}

TEST_CASE("a bias request goes out when armed, and nothing else is taken as a command") {
  Bench bench;
  CHECK(bench.driver->command(BiasCommand{}).error().code == Errc::wrong_state);
  bench.arm();
  CHECK(bench.driver->command(BiasCommand{}).value() == 0);
  CHECK(bench.host.link_.take_written() == hex("12 34 00 42 00 00 00 00"));
  CHECK(bench.driver->command(MoveCommand{}).error().code == Errc::unsupported);
}

TEST_CASE("an armed sensor that falls silent is a fault, and the stream is asked to stop") {
  Bench bench(R"({"stale_after_s": 0.05, "rate_hz": 20})");
  bench.arm();
  for (std::uint32_t i = 2; i < 100; ++i) {
    bench.host.loop_.run_for(0.049);
    bench.receive(i);
  }
  CHECK(bench.host.faults.empty());
  bench.host.loop_.run_for(0.051);
  CHECK(bench.fault_code() == Errc::timeout);
  CHECK(bench.host.link_.take_written() == stop);
  CHECK(bench.host.loop_.timers() == 0);
}

TEST_CASE("a lost opening request is repeated; a box that stays silent is a fault") {
  Bench bench(R"({"reply_timeout_s": 0.2})");
  REQUIRE(bench.driver->open());
  bench.host.loop_.run_for(0.5);
  CHECK(bench.host.link_.take_written() == one_sample + one_sample + one_sample);
  CHECK(bench.host.faults.empty());
  bench.host.loop_.run_for(0.11);
  CHECK(bench.fault_code() == Errc::timeout);
}

TEST_CASE("a box that opens but does not stream faults the arming") {
  Bench bench;
  REQUIRE(bench.driver->open());
  bench.receive(1);
  REQUIRE(bench.driver->arm());
  bench.host.loop_.run_for(1);
  CHECK(bench.fault_code() == Errc::timeout);
}

TEST_CASE("datagrams of 35 bytes or of nothing are dropped with one line in the log") {
  Bench bench;
  bench.arm();
  for (const std::size_t size : {35U, 0U, 37U, 1500U}) bench.receive(Bytes(size, 0));
  CHECK(bench.host.samples.empty());
  CHECK(bench.host.logs.size() == 1);
  bench.receive(2);
  CHECK(bench.host.samples.size() == 1);
}

TEST_CASE("stop and close end the stream; records that still come are ignored") {
  Bench bench;
  bench.arm();
  bench.driver->stop();
  CHECK(bench.host.link_.take_written() == stop);
  CHECK(bench.driver->state() == DriverState::open);
  bench.receive(2);
  CHECK(bench.host.samples.empty());
  bench.host.loop_.run_for(10);
  CHECK(bench.host.faults.empty());
  REQUIRE(bench.driver->arm());
  bench.receive(1);  // a new stream counts from one
  CHECK(bench.driver->state() == DriverState::armed);
  CHECK(bench.host.samples.back().lost == 0);
  bench.driver->close();
  CHECK(bench.driver->state() == DriverState::closed);
  CHECK(bench.host.loop_.timers() == 0);
  CHECK_FALSE(bench.host.link_.listened_to());
}

TEST_CASE("a Net F/T link that breaks faults the driver, and destruction leaves no timer") {
  Bench broken;
  broken.arm();
  broken.host.link_.break_off();
  CHECK(broken.fault_code() == Errc::io);

  Bench destroyed;
  destroyed.arm();
  destroyed.check_gone_without_trace();
}

TEST_CASE("streaming wrenches allocates nothing") {
  Bench bench;
  bench.arm();
  bench.host.record = false;
  Bytes datagram;
  append(datagram, rdt::Record{});
  const std::size_t before = allocations();
  for (std::uint32_t i = 2; i < 1002; ++i) {
    datagram[2] = static_cast<std::uint8_t>(i >> 8);
    datagram[3] = static_cast<std::uint8_t>(i);
    bench.host.link_.deliver(datagram, bench.host.loop_.now());
  }
  CHECK(allocations() - before == 0);
  CHECK(bench.host.published == 1001);
}

}  // namespace netft_test
