#include <catch2/catch.hpp>
#include <memory>

#include "drivers/taxel_array/taxel_driver.hpp"
#include "protocols/taxel/taxel.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace taxel_array_test {

using namespace weft;
using namespace weft::testing;
namespace taxel = protocols::taxel;

namespace {

struct Bench : DriverBench {
  explicit Bench(const std::string& config = "{}")
      : DriverBench(drivers::taxel_array_entry, config) {}
  static Bytes frame(unsigned sequence, std::uint8_t taxels = 16) {
    taxel::Frame f;
    f.sequence = static_cast<std::uint16_t>(sequence);
    f.device_us = sequence * 28000U;
    f.taxel_count = taxels;
    for (std::size_t i = 0; i < taxels; ++i) f.counts[i] = static_cast<std::uint16_t>(1000 + i);
    f.proximity_counts = 7;
    f.ambient_counts = 9;
    Bytes out;
    append(out, f);
    return out;
  }
  void arm() {
    REQUIRE(driver->open());
    receive(frame(10));
    REQUIRE(driver->arm());
    receive(frame(11));
    REQUIRE(driver->state() == DriverState::armed);
    host.samples.clear();
  }
};

}  // namespace

TEST_CASE("the array opens on its first good frame and publishes from the frame that arms it") {
  Bench bench;
  REQUIRE(bench.driver->open());
  bench.receive(Bench::frame(4));
  CHECK(bench.driver->state() == DriverState::open);
  REQUIRE(bench.host.identities.size() == 1);
  CHECK(to_json(bench.host.identities[0]) == R"({"reported":{"taxels":"16"},"scale":{}})");
  CHECK(bench.host.samples.empty());
  REQUIRE(bench.driver->arm());
  CHECK(bench.driver->arm().error().code == Errc::wrong_state);
  bench.host.loop_.run_for(0.028);
  bench.receive(Bench::frame(5));
  CHECK(bench.host.states == std::vector{DriverState::open, DriverState::armed});
  REQUIRE(bench.host.samples.size() == 1);
  const Sample& sample = bench.host.samples[0];
  CHECK(sample.host == bench.host.loop_.now());
  CHECK(sample.sequence == 5);
  const auto& value = std::get<TaxelSample>(sample.value);
  CHECK(value.device_us == 140000);
  CHECK(value.proximity_counts == 7);
  CHECK(value.ambient_counts == 9);
  REQUIRE(bench.host.taxel_counts.size() == 16);
  CHECK(bench.host.taxel_counts[15] == 1015);
  CHECK(bench.host.link_.take_written().empty());  // the driver never writes to the sensor
}

TEST_CASE("frames that the numbers show missing are counted, also through the wrap") {
  Bench bench;
  bench.arm();
  // a number up to half the range ahead is newer
  for (const unsigned sequence : {12U, 15U, 30000U, 60000U, 65535U, 1U})
    bench.receive(Bench::frame(sequence));
  REQUIRE(bench.host.samples.size() == 6);
  CHECK(bench.host.samples[0].lost == 0);
  CHECK(bench.host.samples[1].lost == 2);
  CHECK(bench.host.samples[5].lost == 1);
}

TEST_CASE("a sensor that restarts is noticed and goes on without a made-up loss") {
  Bench bench;
  REQUIRE(bench.driver->open());
  bench.receive(Bench::frame(500));
  REQUIRE(bench.driver->arm());
  bench.receive(Bench::frame(501));
  bench.receive(Bench::frame(0));
  bench.receive(Bench::frame(1));
  CHECK(bench.host.samples.size() == 3);
  for (const Sample& sample : bench.host.samples) CHECK(sample.lost == 0);
  CHECK(bench.host.logs.size() == 1);
}

TEST_CASE("damaged frames are dropped, counted as lost by the next one, and logged sparingly") {
  Bench bench;
  bench.arm();
  for (std::uint16_t sequence = 12; sequence < 20; ++sequence) {
    Bytes bad = Bench::frame(sequence);
    bad[20] ^= 0x10;
    bench.host.loop_.run_for(0.028);
    bench.receive(bad);
  }
  CHECK(bench.host.samples.empty());
  bench.receive(Bench::frame(20));
  REQUIRE(bench.host.samples.size() == 1);
  CHECK(bench.host.samples[0].lost == 8);
  CHECK(bench.host.logs.size() == 1);
  CHECK(bench.host.logs[0].find("damaged") != std::string::npos);
}

TEST_CASE("any chunking gives the same samples") {
  Bench bench;
  bench.arm();
  Bytes stream;
  for (std::uint16_t i = 12; i < 32; ++i) stream = stream + Bench::frame(i);
  for (const std::uint8_t b : stream) bench.receive(Bytes{b});
  CHECK(bench.host.samples.size() == 20);
}

TEST_CASE("another number of taxels than configured is a fault that names both") {
  Bench bench(R"({"taxels": 12})");
  REQUIRE(bench.driver->open());
  bench.receive(Bench::frame(1, 16));
  CHECK(bench.fault_code() == Errc::device_settings);
  CHECK(bench.host.faults[0].expected == "12");
  CHECK(bench.host.faults[0].got == "16");
}

TEST_CASE("a silent array is a fault on opening, on arming and when armed, but not when open") {
  Bench opening(R"({"reply_timeout_s": 1})");
  REQUIRE(opening.driver->open());
  opening.host.loop_.run_for(1.01);
  CHECK(opening.fault_code() == Errc::timeout);

  Bench arming;
  REQUIRE(arming.driver->open());
  arming.receive(Bench::frame(1));
  arming.host.loop_.run_for(100);
  CHECK(arming.host.faults.empty());
  REQUIRE(arming.driver->arm());
  arming.host.loop_.run_for(2);
  CHECK(arming.fault_code() == Errc::timeout);

  Bench armed(R"({"stale_after_s": 0.3})");
  armed.arm();
  armed.host.loop_.run_for(0.29);
  armed.receive(Bench::frame(12));
  armed.host.loop_.run_for(0.29);
  CHECK(armed.host.faults.empty());
  armed.host.loop_.run_for(0.02);
  CHECK(armed.fault_code() == Errc::timeout);
}

TEST_CASE("CPM-Finger datagrams are put in taxel order and numbered by the driver") {
  Bench bench(R"({"form": "cpm_udp"})");
  taxel::cpm::Counts counts{};
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = static_cast<std::uint16_t>(i * 100);
  const auto encoded = taxel::cpm::encode_datagram(counts);
  const Bytes datagram(encoded.begin(), encoded.end());
  REQUIRE(bench.driver->open());
  bench.receive(datagram);
  REQUIRE(bench.driver->arm());
  bench.receive(datagram);
  bench.receive(Bytes(31, 0));
  bench.receive(datagram);
  REQUIRE(bench.host.samples.size() == 2);
  CHECK(bench.host.samples[1].sequence == bench.host.samples[0].sequence + 1);
  CHECK(bench.host.taxel_counts == std::vector<std::uint16_t>(counts.begin(), counts.end()));
  CHECK(bench.host.logs.size() == 1);
}

TEST_CASE("commands, wrong states, stop and close of the array") {
  Bench bench;
  CHECK(bench.driver->arm().error().code == Errc::wrong_state);
  CHECK(bench.driver->command(BiasCommand{}).error().code == Errc::wrong_state);
  bench.arm();
  CHECK(bench.driver->command(BiasCommand{}).error().code == Errc::unsupported);
  bench.driver->stop();
  CHECK(bench.driver->state() == DriverState::open);
  bench.receive(Bench::frame(12));
  bench.host.loop_.run_for(10);
  CHECK(bench.host.samples.empty());
  CHECK(bench.host.faults.empty());
  bench.driver->close();
  CHECK(bench.driver->state() == DriverState::closed);
  CHECK(bench.host.loop_.timers() == 0);
  CHECK_FALSE(bench.host.link_.listened_to());
  bench.arm();
  bench.host.link_.break_off();
  CHECK(bench.fault_code() == Errc::io);
}

TEST_CASE("streaming taxels allocates nothing") {
  Bench bench;
  bench.arm();
  bench.host.record = false;
  std::vector<Bytes> frames;
  for (std::uint16_t i = 12; i < 512; ++i) frames.push_back(Bench::frame(i));
  const std::size_t before = allocations();
  for (const Bytes& frame : frames) bench.host.link_.deliver(frame, bench.host.loop_.now());
  CHECK(allocations() - before == 0);
  CHECK(bench.host.published == 501);
}

TEST_CASE("rows and columns give the number of taxels, and another number is refused") {
  const auto taxels = [](const char* config) {
    const auto settings = drivers::read_taxel_settings(config);
    return settings ? int{settings->taxels} : 0;
  };
  CHECK(taxels("{}") == 16);
  CHECK(taxels(R"({"rows": 4, "cols": 8})") == 32);
  CHECK(taxels(R"({"rows": 4, "cols": 8, "taxels": 32})") == 32);
  CHECK(taxels(R"({"taxels": 2, "positions_mm": [0, 0, 4, 0]})") == 2);
  for (const char* const wrong :
       {R"({"rows": 4, "cols": 8, "taxels": 31})", R"({"rows": 4})", R"({"rows": 9, "cols": 8})",
        R"({"taxels": 2, "positions_mm": [0, 0, 4]})",
        R"({"rows": 4, "cols": 8, "form": "cpm_udp"})"})
    CHECK(taxels(wrong) == 0);
}

}  // namespace taxel_array_test
