// Faults between the Digital F/T sensor and its driver.

#include <catch2/catch.hpp>

#include "tests/unit/allocations.hpp"
#include "tests/unit/drivers/ati_digital_support.hpp"

namespace ati_digital_faults_test {

using namespace weft;
using namespace weft::testing;
using Bench = DigitalBench;

TEST_CASE("a sensor that a dead host left streaming is stopped before it is asked anything") {
  Bench bench;
  REQUIRE(bench.driver->open());
  CHECK(bench.host.link_.take_written() == jam);
  for (int i = 0; i < 3; ++i) bench.stream({1, 2, 3, 4, 5, 6});
  bench.quiet();  // the line is not silent: once more
  CHECK(bench.host.link_.take_written() == jam);
  bench.quiet();
  CHECK(bench.serve().size() > 0);
  CHECK(bench.driver->state() == DriverState::open);
}

TEST_CASE("a port that never falls silent is a fault") {
  Bench bench;
  REQUIRE(bench.driver->open());
  for (int i = 0; i < 100 && bench.host.faults.empty(); ++i) {
    bench.receive(hex("55 55"));
    bench.host.loop_.run_for(0.02);
  }
  CHECK(bench.fault().code == Errc::timeout);
}

TEST_CASE("a lost answer is asked for again; a silent sensor is a fault after three requests") {
  Bench bench(R"({"reply_timeout_s": 0.2})");
  REQUIRE(bench.driver->open());
  bench.quiet();
  CHECK(bench.host.link_.take_written() == jam + read_status);
  bench.host.loop_.run_for(0.2);
  bench.quiet();
  CHECK(bench.host.link_.take_written() == jam + read_status);
  bench.reply(ReadReply{Function::read_holding, Registers(std::array<std::uint16_t, 1>{0})});
  bench.reply(
      ReadReply{Function::read_holding, Registers(std::array<std::uint16_t, 1>{4})});  // late
  bench.quiet();  // the late answer was received: once more
  bench.quiet();
  bench.serve();
  CHECK(bench.driver->state() == DriverState::open);

  Bench silent(R"({"reply_timeout_s": 0.2})");
  REQUIRE(silent.driver->open());
  silent.host.loop_.run_for(3);
  CHECK(silent.fault().code == Errc::timeout);
}

TEST_CASE("answers in single bytes, damaged ones and those of others do no harm") {
  Bench bench;
  REQUIRE(bench.driver->open());
  bench.quiet();
  bench.host.link_.take_written();
  bench.receive(hex("0A 03 02 00 00 1D 84"));  // CRC
  bench.receive(hex("0A 04 02 00 00 1C F1"));  // another function
  for (const std::uint8_t b : hex("0A 03 02 00 00 1D 85")) bench.receive({b});
  bench.serve();
  CHECK(bench.driver->state() == DriverState::open);
}

TEST_CASE("a sensor that reports a fault is refused with its name; its watchdog alone is not") {
  Bench bench;
  bench.status_word = 1U << 2;
  bench.open();
  CHECK(bench.fault().got == "4 (excitation voltage low)");
  Bench restarted;
  restarted.status_word = 1;
  restarted.open();
  CHECK(restarted.driver->state() == DriverState::open);
  CHECK(restarted.host.logs.size() == 1);
}

TEST_CASE("an empty calibration, an exception and a refusal are reported faults") {
  Bench empty(R"({"calibration": 1})");
  empty.held = {};
  empty.open();
  CHECK(empty.fault().code == Errc::range);
  CHECK(empty.fault().where == "calibration 1");

  Bench other;
  REQUIRE(other.driver->open());
  other.quiet();
  other.reply(Exception{3, ExceptionCode::illegal_address});
  CHECK(other.fault().got == "exception 2, illegal data address");

  Bench refused;
  refused.open();
  REQUIRE(refused.driver->arm());
  refused.reply(Vendor{Function::vendor_stream, 0});
  CHECK(refused.fault().code == Errc::device_refused);

  Bench stubborn;
  stubborn.takes_writes = false;
  stubborn.open();
  CHECK(stubborn.fault().code == Errc::device_refused);
}

TEST_CASE("another calibration than the rig file names is refused with both names") {
  Bench bench(R"({"calibration_serial": "FT12289"})");
  bench.open();
  CHECK(bench.fault().where == "calibration 1: /calibration_serial");
  CHECK(bench.fault().expected == "FT12289");
  CHECK(bench.fault().got == "FT12288");
  Bench same(R"({"calibration_serial": "FT12288"})");
  same.open();
  CHECK(same.driver->state() == DriverState::open);
}

TEST_CASE("gauges that all stand still for stuck_after_s are a fault, unless it is 0") {
  for (const bool inspections : {true, false}) {
    Bench bench(inspections ? R"({"stuck_after_s": 0.5})" : R"({"stuck_after_s": 0})");
    bench.arm();
    for (int i = 0; i < 100 && bench.host.faults.empty(); ++i) {
      bench.host.loop_.run_for(0.01);
      bench.stream({7, 7, 7, 7, 7, 7});
    }
    CHECK(bench.host.faults.size() == (inspections ? 1U : 0U));
    if (inspections) CHECK(bench.fault().code == Errc::device_data);
    CHECK(bench.host.samples.size() >= 49);
  }
}

TEST_CASE("bytes that hold no whole record are told apart from silence") {
  Bench bench(R"({"stale_after_s": 0.05})");
  bench.arm();
  for (int i = 0; i < 10 && bench.host.faults.empty(); ++i) {
    bench.receive(hex("01 02 03"));
    bench.host.loop_.run_for(0.01);
  }
  CHECK(bench.fault().code == Errc::device_data);
}

TEST_CASE("storage that was unlocked is locked again when opening ends in a fault") {
  Bench bench;
  REQUIRE(bench.driver->open());
  bench.quiet();
  RtuSplitter splitter(Side::requests, 10);
  for (int i = 0; i < 5; ++i) {  // up to the answer to the unlock request
    splitter.push(bench.host.link_.take_written());
    while (const auto pdu = splitter.next())
      bench.reply(bench.answer(decode_request(*pdu).value()));
  }
  bench.host.link_.take_written();
  bench.reply(Exception{16, ExceptionCode::device_failure});
  CHECK(bench.fault().code == Errc::device_refused);
  CHECK(bench.host.link_.take_written() == jam + lock_request);
}

TEST_CASE("an armed sensor that falls silent is a fault, and its stream is ended") {
  Bench bench(R"({"rate_hz": 20, "stale_after_s": 0.05})");
  bench.arm();
  for (std::int16_t i = 0; i < 100; ++i) {
    bench.host.loop_.run_for(0.049);
    bench.stream({i, 0, 0, 0, 0, 0});
  }
  CHECK(bench.host.faults.empty());
  bench.host.link_.take_written();
  bench.host.loop_.run_for(0.051);
  CHECK(bench.fault().code == Errc::timeout);
  CHECK(bench.host.link_.take_written() == jam);
}

TEST_CASE("stop and close end the Digital F/T's stream, and it can be armed again") {
  Bench bench;
  bench.arm();
  bench.driver->stop();
  CHECK(bench.host.link_.take_written() == jam);
  CHECK(bench.driver->state() == DriverState::open);
  bench.stream({1, 2, 3, 4, 5, 6});
  CHECK(bench.host.samples.empty());
  bench.host.loop_.run_for(10);
  CHECK(bench.host.faults.empty());
  REQUIRE(bench.driver->arm());
  CHECK(bench.driver->arm().error().code == Errc::wrong_state);
  bench.receive(started);
  bench.stream({});
  CHECK(bench.driver->state() == DriverState::armed);
  bench.driver->close();
  CHECK(bench.driver->state() == DriverState::closed);
  CHECK(bench.host.loop_.timers() == 0);
  CHECK_FALSE(bench.host.link_.listened_to());
}

TEST_CASE("a Digital F/T link that breaks faults the driver, and destruction leaves no timer") {
  Bench broken;
  broken.arm();
  broken.host.link_.break_off();
  CHECK(broken.fault().code == Errc::io);

  Bench unwritable;
  unwritable.host.link_.broken = true;
  CHECK_FALSE(unwritable.driver->open());
  CHECK(unwritable.fault().code == Errc::io);

  Bench destroyed;
  REQUIRE(destroyed.driver->open());
  destroyed.check_gone_without_trace();
}

TEST_CASE("streaming gauge records allocates nothing") {
  Bench bench;
  bench.arm();
  bench.host.record = false;
  Bytes record;
  append(record, StreamRecord{{1, 2, 3, 4, 5, 6}, false});
  const std::size_t published = bench.host.published;
  bench.host.link_.deliver(record, bench.host.loop_.now());
  const std::size_t before = allocations();
  for (int i = 0; i < 1000; ++i) bench.host.link_.deliver(record, bench.host.loop_.now());
  CHECK(allocations() - before == 0);
  CHECK(bench.host.published == published + 1001);
}

}  // namespace ati_digital_faults_test
