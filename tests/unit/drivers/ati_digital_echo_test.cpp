// A half-duplex adapter echoes each byte that is sent through it.

#include "tests/unit/drivers/ati_digital_support.hpp"

namespace ati_digital_echo_test {

using namespace weft;
using namespace weft::testing;

namespace {

/// Echoes the driver's bytes in pieces, and then answers.
struct EchoingBench : DigitalBench {
  using DigitalBench::DigitalBench;
  std::size_t piece = 1000;

  void give_back(const Bytes& bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      receive(
          Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + piece, bytes.size()))));
  }
  void serve_with_echo() {
    RtuSplitter splitter(Side::requests, 10);
    for (Bytes written = host.link_.take_written(); !written.empty();
         written = host.link_.take_written()) {
      give_back(written);
      splitter.push(written);
      while (const auto pdu = splitter.next()) reply(answer(decode_request(*pdu).value()));
    }
  }
  void open_with_echo(bool late) {
    REQUIRE(driver->open());
    const Bytes written = host.link_.take_written();
    REQUIRE(written == jam);
    if (!late) give_back(written);
    quiet();
    if (late) give_back(written);
    serve_with_echo();
  }
};

}  // namespace

TEST_CASE("an echo of what is sent is skipped, in any pieces and late, from opening to streaming") {
  for (const std::size_t piece : {std::size_t{1}, std::size_t{3}, std::size_t{1000}})
    for (const bool late : {false, true}) {
      INFO("pieces of " << piece << (late ? ", late" : ""));
      EchoingBench bench;
      bench.piece = piece;
      bench.open_with_echo(late);
      REQUIRE(bench.driver->state() == DriverState::open);
      CHECK(bench.host.logs.size() == 1);
      CHECK(bench.active_gain == calibration().gain);
      REQUIRE(bench.driver->arm());
      const Bytes start = bench.host.link_.take_written();
      REQUIRE(start == start_request);
      bench.give_back(start);
      bench.receive(started);
      bench.stream({1000, -2000, 3000, 0, 0, 0});
      REQUIRE(bench.driver->state() == DriverState::armed);
      CHECK(bench.last().force_n[0] == Approx(1));
      CHECK(bench.last().force_n[1] == Approx(-2));
      CHECK(bench.host.faults.empty());
    }
}

TEST_CASE("a line without an echo is not handled as one with an echo") {
  DigitalBench bench;
  bench.arm();
  CHECK(bench.host.logs.empty());
}

TEST_CASE("zeros beyond an echo are a sensor that still sends") {
  DigitalBench bench;
  REQUIRE(bench.driver->open());
  CHECK(bench.host.link_.take_written() == jam);
  bench.receive(Bytes(73, 0));
  bench.quiet();
  CHECK(bench.host.link_.take_written() == jam);  // once more
}

}  // namespace ati_digital_echo_test
