#include <catch2/catch.hpp>
#include <memory>
#include <optional>

#include "drivers/ati_digital/ati_digital.hpp"
#include "drivers/ati_digital/digital_driver.hpp"
#include "protocols/ati_digital/calibration.hpp"
#include "protocols/ati_digital/stream.hpp"
#include "protocols/modbus/rtu.hpp"
#include "tests/unit/drivers/fakes.hpp"

using namespace weft;
using namespace weft::testing;
using namespace weft::protocols::modbus;
using namespace weft::protocols::ati_digital;
using weft::drivers::stream_status_error;

namespace {

const Bytes jam(72, 0);
const Bytes read_status = hex("0A 03 00 1D 00 01 15 77");
const Bytes unlock_request = hex("0A 6A AA FF 1D");
const Bytes lock_request = hex("0A 6A 18 7F 68");
const Bytes start_request = hex("0A 46 55 A3 9D");
const Bytes started = hex("0A 46 01 A2 62");

Calibration calibration() {
  Calibration c;
  c.serial = "FT12288";
  c.part_number = "SI-40-2";
  c.family = "DFT";
  c.time = "2019/05/07";
  for (std::size_t i = 0; i < 6; ++i) c.matrix[i][i] = 1000;  // 1 mN or 1 mN m a count
  c.max_rating = {40, 40, 120, 2, 2, 2};
  c.counts_per_force = c.counts_per_torque = 1000000;
  c.gain = {543, 555, 569, 579, 565, 567};
  c.offset = {1, 2, 3, 4, 5, 6};
  return c;
}

/// A sensor that answers from its registers, and a host around the driver.
struct Bench {
  explicit Bench(const std::string& config = "{}") {
    auto made = drivers::ati_digital_entry.create(config, host);
    REQUIRE(made);
    driver = std::move(*made);
  }
  void reply(const Reply& reply) {
    Bytes bytes;
    append_rtu(bytes, 10, reply);
    receive(bytes);
  }
  void receive(const Bytes& bytes) { host.link_.deliver(bytes, host.loop_.now()); }
  void quiet() { host.loop_.advance(0.051); }

  Reply answer(const Request& request) {
    if (const auto* read = std::get_if<Read>(&request)) {
      const auto record = encode(held);
      ReadReply reply{read->function, {}};
      reply.registers.count = static_cast<std::uint8_t>(read->count);
      for (std::size_t i = 0; i < read->count; ++i) {
        const std::size_t at = read->address + i;
        std::uint16_t& value = reply.registers.values[i];
        if (at < 6)
          value = active_gain[at];
        else if (at < 12)
          value = active_offset[at - 6];
        else if (at == holding::status)
          value = status_word;
        else if (at >= first)
          value = record.at(at - first);
      }
      return reply;
    }
    if (const auto* write = std::get_if<WriteMany>(&request)) {
      auto& target = write->address == 0 ? active_gain : active_offset;
      if (takes_writes) std::copy_n(write->registers.values.begin(), 6, target.begin());
      return WroteMany{write->address, write->registers.count};
    }
    return Vendor{std::get<Vendor>(request).function, 1};
  }
  /// Answers what the driver wrote, until it writes nothing more. Returns all that it wrote.
  Bytes serve() {
    Bytes all;
    RtuSplitter splitter(Side::requests, 10);
    for (Bytes written = host.link_.take_written(); !written.empty();
         written = host.link_.take_written()) {
      all = all + written;
      splitter.push(written);
      while (const auto pdu = splitter.next()) reply(answer(decode_request(*pdu).value()));
    }
    return all;
  }
  Bytes open() {
    REQUIRE(driver->open());
    CHECK(host.link_.take_written() == jam);
    quiet();
    return serve();
  }
  void stream(const std::array<std::int16_t, 6>& counts, bool error = false) {
    Bytes bytes;
    append(bytes, StreamRecord{counts, error});
    receive(bytes);
  }
  void arm() {
    open();
    REQUIRE(driver->state() == DriverState::open);
    REQUIRE(driver->arm());
    CHECK(host.link_.take_written() == start_request);
    receive(started);
    stream({});
    REQUIRE(driver->state() == DriverState::armed);
    host.samples.clear();
  }
  const WrenchSample& last() { return std::get<WrenchSample>(host.samples.back().value); }
  const Error& fault() {
    REQUIRE(host.faults.size() == 1);
    REQUIRE(driver->state() == DriverState::faulted);
    CHECK(host.loop_.timers() == 0);
    return host.faults[0];
  }

  static constexpr std::uint16_t first = holding::first_calibration;
  Calibration held = calibration();
  std::array<std::uint16_t, 6> active_gain{}, active_offset{};
  std::uint16_t status_word = 0;
  bool takes_writes = true;
  FakeHost host;
  std::unique_ptr<Driver> driver;
};

std::size_t position(const Bytes& in, const Bytes& what) {
  return static_cast<std::size_t>(std::search(in.begin(), in.end(), what.begin(), what.end()) -
                                  in.begin());
}

}  // namespace

TEST_CASE("opening reads status and calibration, makes it active, and tells who the sensor is") {
  Bench bench;
  const Bytes said = bench.open();
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
    const std::size_t found = position(said, frame);
    CHECK(found < said.size());
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
  CHECK(bench.host.link_.take_written().empty());  // the sensor knows no bias
  bench.stream({20000, 0, 0, 0, 0, 0});
  CHECK(bench.last().force_n[0] == Approx(0));
  bench.stream({30000, 0, 0, 0, 0, 0});
  CHECK(bench.last().force_n[0] == Approx(10));
  CHECK(bench.last().valid);
  CHECK(bench.driver->command(MoveCommand{}).error().code == Errc::unsupported);
}

TEST_CASE("a sensor that a dead host left streaming is stopped before it is asked anything") {
  Bench bench;
  REQUIRE(bench.driver->open());
  CHECK(bench.host.link_.take_written() == jam);
  for (int i = 0; i < 3; ++i) bench.stream({1, 2, 3, 4, 5, 6});
  bench.quiet();  // not quiet: once more
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
    bench.host.loop_.advance(0.02);
  }
  CHECK(bench.fault().code == Errc::timeout);
}

TEST_CASE("a lost answer is asked for again; a silent sensor is a fault after three requests") {
  Bench bench(R"({"reply_timeout_s": 0.2})");
  REQUIRE(bench.driver->open());
  bench.quiet();
  CHECK(bench.host.link_.take_written() == jam + read_status);
  bench.host.loop_.advance(0.2);
  bench.quiet();
  CHECK(bench.host.link_.take_written() == jam + read_status);
  bench.reply(ReadReply{Function::read_holding, Registers(std::array<std::uint16_t, 1>{0})});
  bench.reply(
      ReadReply{Function::read_holding, Registers(std::array<std::uint16_t, 1>{4})});  // late
  bench.quiet();  // the late answer was heard: once more
  bench.quiet();
  bench.serve();
  CHECK(bench.driver->state() == DriverState::open);

  Bench silent(R"({"reply_timeout_s": 0.2})");
  REQUIRE(silent.driver->open());
  silent.host.loop_.advance(3);
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

TEST_CASE("an empty calibration, an exception and a refusal are faults that say so") {
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
  CHECK(refused.fault().code == Errc::device);

  Bench stubborn;
  stubborn.takes_writes = false;
  stubborn.open();
  CHECK(stubborn.fault().code == Errc::device);
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
  CHECK(bench.fault().code == Errc::device);
  CHECK(bench.host.link_.take_written() == jam + lock_request);
}

TEST_CASE("an armed sensor that falls silent is a fault, and its stream is ended") {
  Bench bench(R"({"stale_after_s": 0.05})");
  bench.arm();
  for (std::int16_t i = 0; i < 100; ++i) {
    bench.host.loop_.advance(0.049);
    bench.stream({i, 0, 0, 0, 0, 0});
  }
  CHECK(bench.host.faults.empty());
  bench.host.link_.take_written();
  bench.host.loop_.advance(0.051);
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
  bench.host.loop_.advance(10);
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
  CHECK(destroyed.host.loop_.timers() > 0);
  destroyed.driver.reset();
  CHECK(destroyed.host.loop_.timers() == 0);
  CHECK_FALSE(destroyed.host.link_.listened_to());
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
