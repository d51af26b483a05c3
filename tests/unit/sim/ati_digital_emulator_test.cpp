#include "sim/devices/ati_digital_emulator.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "protocols/base/bytes.hpp"
#include "sim/devices/rdt_emulator.hpp"
#include "tests/unit/sim/support.hpp"

namespace ati_digital_emulator_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::protocols::modbus;
namespace digital = protocols::ati_digital;
using test::hex;

namespace {

struct Sensor {
  explicit Sensor(AtiDigitalParams params = {})
      : bench_plant(test::still_plant(), 1), device(params, bench_plant, 1) {}

  /// The immediate answer; silence precedes the request.
  Bytes query(const Bytes& bytes) {
    run(0.1);
    received.clear();
    device.receive(bytes, now, sink);
    return std::exchange(received, {});
  }
  Bytes query(const std::string& text) { return query(hex(text)); }
  Reply query(const Request& request) {
    Bytes bytes;
    append_rtu(bytes, 10, request);
    RtuSplitter splitter(Side::replies, 10);
    splitter.push(query(bytes));
    return decode_reply(splitter.next().value()).value();
  }
  std::uint16_t holding(std::uint16_t address) {
    return std::get<ReadReply>(query(Read{Function::read_holding, address, 1})).registers.values[0];
  }
  void run(double seconds) {
    const TimePoint end = now + from_seconds(seconds);
    for (auto at = device.next_wakeup(); at && *at <= end; at = device.next_wakeup())
      device.wake(now = std::max(*at, now), sink);
    now = end;
  }
  digital::Calibration calibration() {
    std::vector<std::uint16_t> registers;
    std::uint16_t address = digital::calibration_address(1);
    for (const std::uint16_t count : digital::calibration_pieces) {
      const Reply reply = query(Read{Function::read_holding, address, count});
      const auto view = std::get<ReadReply>(reply).registers.view();
      registers.insert(registers.end(), view.begin(), view.end());
      address = static_cast<std::uint16_t>(address + count);
    }
    return digital::decode_calibration(registers).value();
  }
  std::vector<digital::StreamRecord> take() {
    std::vector<digital::StreamRecord> records;
    ByteView bytes = received;
    for (; bytes.size() >= digital::record_size; bytes = bytes.subspan(digital::record_size))
      records.push_back(digital::decode_record(bytes).value());
    received.clear();
    return records;
  }

  Bytes received;
  ByteSink sink = [this](ByteView b) { received.insert(received.end(), b.begin(), b.end()); };
  TimePoint now{};
  BenchPlant bench_plant;
  AtiDigitalEmulator device;
};

const std::string start = "0A 46 55 A3 9D";
const Bytes started = hex("0A 46 01 A2 62");
const Bytes jam = hex("01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E");  // of VERDEL

std::array<double, 6> as_doubles(const std::array<std::int16_t, 6>& counts) {
  std::array<double, 6> out{};
  std::copy(counts.begin(), counts.end(), out.begin());
  return out;
}

ExceptionCode refused(const Reply& reply) {
  return std::get<Exception>(reply).code;
}

}  // namespace

TEST_CASE("the emulated Digital F/T gives the document's answers to the document's requests") {
  Sensor sensor;
  CHECK(sensor.query("0A 03 00 1D 00 01 15 77") == hex("0A 03 02 00 00 1D 85"));
  CHECK(sensor.query("0A 6A AA FF 1D") == hex("0A 6A 01 BE A2"));
  CHECK(sensor.query("0A 10 00 00 00 06 0C 02 1F 02 2B 02 39 02 43 02 35 02 37 47 2D") ==
        hex("0A 10 00 00 00 06 41 70"));
  CHECK(sensor.query("0A 10 00 1F 00 01 02 00 02 56 CE").size() == 8);
  CHECK(sensor.holding(digital::holding::baud_index) == 2);
  CHECK(sensor.query("0A 6A 18 7F 68") == hex("0A 6A 01 BE A2"));
  CHECK(sensor.query("0A 03 00 E3 00 40 B4 B7").size() == 5 + 128);
  CHECK(sensor.query("0A 04 00 00 00 06 71 73").size() == 5 + 12);
  CHECK(sensor.query("0A 04 00 27 00 06 C1 78").size() == 5 + 12);
  CHECK(sensor.query("0B 03 00 1D 00 01 14 A6").empty());  // another slave
}

TEST_CASE("gains are written only while the storage is unlocked, and scale the gauges") {
  Sensor sensor;
  const Request half_gain = WriteOne{0, 271};  // of 543
  CHECK(refused(sensor.query(half_gain)) == ExceptionCode::device_failure);
  sensor.query("0A 6A AA FF 1D");
  sensor.bench_plant.stage(AxisId::z, sensor.now).move_to(0.1002, {0.01, 0.1}, sensor.now);
  sensor.run(5);
  const auto gauges = [&] {
    return std::get<ReadReply>(sensor.query(Read{Function::read_input, 0, 6})).registers.values;
  };
  const auto whole = static_cast<std::int16_t>(gauges()[0]);
  CHECK(sensor.query(half_gain) == Reply(WriteOne{0, 271}));
  CHECK(static_cast<std::int16_t>(gauges()[0]) == Approx(whole * 271.0 / 543).margin(10));
  CHECK(std::abs(whole) > 100);
}

TEST_CASE("requests for what is not there are refused with the standard's codes") {
  Sensor sensor;
  sensor.query("0A 6A AA FF 1D");
  CHECK(refused(sensor.query(Read{Function::read_holding, 0x0CE3, 1})) ==
        ExceptionCode::illegal_address);
  CHECK(refused(sensor.query(Read{Function::read_holding, 0xFFFF, 125})) ==
        ExceptionCode::illegal_address);
  CHECK(refused(sensor.query(Read{Function::read_input, 0x002C, 2})) ==
        ExceptionCode::illegal_address);
  CHECK(sensor.query(WriteOne{digital::holding::session_id, 5}) ==
        Reply(WriteOne{digital::holding::session_id, 5}));
  CHECK(refused(sensor.query(WriteOne{digital::holding::status, 1})) ==
        ExceptionCode::illegal_address);
  CHECK(refused(sensor.query(WriteOne{digital::holding::baud_index, 3})) ==
        ExceptionCode::illegal_value);
  CHECK(sensor.query("0A 01 00 00 00 01 FC B1") == hex("0A 81 01 F0 52"));  // coils: none
  CHECK(sensor.query(Vendor{Function::vendor_lock, 0x77}) ==
        Reply(Vendor{Function::vendor_lock, 0}));
  CHECK(sensor.query(Vendor{Function::vendor_stream, 1}) ==
        Reply(Vendor{Function::vendor_stream, 0}));
  CHECK_FALSE(sensor.device.streaming());
}

TEST_CASE("the stream begins behind the answer, at its rate, and any 14 bytes end it") {
  for (const double rate : {1.0, 37.0, 100.0, 7000.0}) {
    AtiDigitalParams params;
    params.rate_hz = rate;
    Sensor sensor(params);
    const Bytes first = sensor.query(start);
    CHECK(Bytes(first.begin(), first.begin() + 5) == started);
    sensor.received.assign(first.begin() + 5, first.end());
    sensor.run(2 - 1e-6);
    CHECK(sensor.take().size() == static_cast<std::size_t>(2 * rate));
    sensor.device.receive(ByteView(jam).first(13), sensor.now, sensor.sink);
    CHECK(sensor.device.streaming());
    sensor.device.receive(ByteView(jam).last(1), sensor.now, sensor.sink);
    CHECK_FALSE(sensor.device.streaming());
    CHECK(sensor.query("0A 03 00 1D 00 01 15 77") == hex("0A 03 02 00 00 1D 85"));
  }
}

TEST_CASE("a few bytes now and then do not end a stream") {
  Sensor sensor;
  sensor.query(start);
  for (int i = 0; i < 10; ++i) sensor.query("01 02 03 04 05");
  CHECK(sensor.device.streaming());
}

TEST_CASE("the calibration gives back the load of the sensor within its gauges' counts") {
  AtiDigitalParams params;
  params.sensor.noise = {};
  params.sensor.centre_x_m = 0.05;
  params.sensor.centre_y_m = 0.085;
  Sensor sensor(params);
  const digital::GaugeMatrix matrix = digital::gauge_matrix(sensor.calibration()).value();
  CHECK(matrix.rating == std::array<double, 6>{40, 40, 120, 2, 2, 2});
  sensor.bench_plant.stage(AxisId::z, sensor.now).move_to(0.1005, {0.01, 0.1}, sensor.now);
  sensor.run(5);
  sensor.bench_plant.stage(AxisId::y, sensor.now).move_to(0.1, {2e-3, 0.02}, sensor.now);
  sensor.query(start);
  sensor.received.clear();
  sensor.run(3);
  const TimePoint end = sensor.now;
  const auto last = sensor.take().back();
  // 100 records a second from the start: the last one came 10 ms before the end
  const Wrench load = FtSensor(params.sensor, 1).load(sensor.bench_plant.contact(end));
  const auto wrench = matrix.wrench(as_doubles(last.gauge_counts));
  const Wrench quantum{0.01, 0.01, 0.02, 0.00025, 0.00025, 0.00025};  // SI-40-2
  for (std::size_t i = 0; i < 6; ++i) CHECK(wrench[i] == Approx(load[i]).margin(quantum[i]));
  CHECK(wrench[2] > 5);
}

TEST_CASE("a load far over the range drives gauges to their rails") {
  Sensor sensor;
  sensor.bench_plant.stage(AxisId::z, sensor.now).move_to(0.13, {0.01, 0.1}, sensor.now);
  sensor.run(10);
  sensor.query(start);
  sensor.received.clear();
  sensor.run(0.1);
  const auto record = sensor.take().back();
  CHECK(std::any_of(record.gauge_counts.begin(), record.gauge_counts.end(),
                    [](std::int16_t c) { return c == 32767 || c == -32768; }));
}

TEST_CASE("a fault of the sensor is in its status word and in every record") {
  AtiDigitalParams params;
  params.status_word = 1U << 2;
  Sensor sensor(params);
  CHECK(sensor.holding(digital::holding::status) == 4);
  sensor.query(start);
  sensor.received.clear();
  sensor.run(0.1);
  for (const auto& record : sensor.take()) CHECK(record.status_error);
}

TEST_CASE("behind a Modbus TCP gateway there are registers and no stream") {
  AtiDigitalParams params;
  params.modbus_tcp = true;
  Sensor sensor(params);
  // transaction 0x1234, unit 10
  CHECK(sensor.query("12 34 00 00 00 06 0A 03 00 1D 00 01") ==
        hex("12 34 00 00 00 05 0A 03 02 00 00"));
  CHECK(sensor.query("00 01 00 00 00 03 0A 46 55") == hex("00 01 00 00 00 03 0A C6 01"));
  // address 11 does not exist; 0 and 255 address any device
  CHECK(sensor.query("00 01 00 00 00 06 0B 03 00 1D 00 01") == hex("00 01 00 00 00 03 0B 83 0B"));
  CHECK(sensor.query("00 01 00 00 00 06 FF 03 00 1D 00 01") ==
        hex("00 01 00 00 00 05 FF 03 02 00 00"));
  CHECK(sensor.query("00 01 00 00 00 06 00 03 00 1D 00 01") ==
        hex("00 01 00 00 00 05 00 03 02 00 00"));
  CHECK_FALSE(sensor.device.streaming());
}

TEST_CASE("a truncated request is over when the line has been silent") {
  Sensor sensor;
  CHECK(sensor.query("0A 10 00 00 00 06 0C 02 1F").empty());
  CHECK(sensor.query("0A 03 00 1D 00 01 15 77") == hex("0A 03 02 00 00 1D 85"));
}

TEST_CASE("every function that the sensor does not have is refused with exception 1") {
  Sensor sensor;
  for (int code = 1; code < 0x80; ++code) {
    const auto function = static_cast<std::uint8_t>(code);
    const bool served =
        code == 3 || code == 4 || code == 6 || code == 0x10 || code == 0x46 || code == 0x6A;
    if (served) continue;
    // With the length that the standard states, if it states one.
    Bytes request{10, function, 0, 0, 0, 1};
    if (code == 0x07 || code == 0x0B || code == 0x0C || code == 0x11) request = {10, function};
    if (code == 0x0F) request = {10, function, 0, 0, 0, 8, 1, 0xFF};
    if (code == 0x14 || code == 0x15) request = {10, function, 7, 6, 0, 4, 0, 1, 0, 2};
    if (code == 0x16) request = {10, function, 0, 4, 0, 0xF2, 0, 0x25};
    if (code == 0x17) request = {10, function, 0, 0, 0, 1, 0, 0, 0, 1, 2, 0, 0};
    if (code == 0x18) request = {10, function, 0, 1};
    if (code == 0x2B) request = {10, function, 0x0E, 1, 0};  // read device identification
    LittleWriter(request).write(crc16_modbus(request));
    Bytes refusal{10, static_cast<std::uint8_t>(code | 0x80), 1};
    LittleWriter(refusal).write(crc16_modbus(refusal));
    CAPTURE(code);
    CHECK(sensor.query(request) == refusal);
  }
  CHECK(sensor.query("0A 03 00 1D 00 01 15 77") == hex("0A 03 02 00 00 1D 85"));
}

TEST_CASE("a wrong quantity is a wrong value, whatever the address is") {
  Sensor sensor;
  const auto refusal = [&](const std::string& text) {
    Bytes request = hex(text);
    LittleWriter(request).write(crc16_modbus(request));
    const Bytes reply = sensor.query(request);
    REQUIRE(reply.size() == 5);
    CHECK(reply[1] == (request[1] | 0x80));
    return int{reply[2]};
  };
  CHECK(refusal("0A 03 00 00 00 00") == 3);
  CHECK(refusal("0A 03 FF FF 00 7E") == 3);
  CHECK(refusal("0A 04 00 00 00 7E") == 3);
  CHECK(refusal("0A 10 00 00 00 00 00") == 3);
  CHECK(refusal("0A 10 00 00 00 02 02 00 01") == 3);  // two registers in two bytes
  CHECK(refusal("0A 03 0C E0 00 7D") == 2);
  CHECK(refusal("0A 04 00 2D 00 01") == 2);
  CHECK(refusal("0A 06 00 1D 00 00") == 2);
  CHECK(refusal("0A 10 00 0C 00 02 04 00 01 00 01") == 2);
}

TEST_CASE("a write to all slaves is done and not answered") {
  Sensor sensor;
  sensor.query("0A 6A AA FF 1D");
  Bytes to_all = hex("00 06 00 1F 00 02");
  LittleWriter(to_all).write(crc16_modbus(to_all));
  CHECK(sensor.query(to_all).empty());
  CHECK(sensor.holding(digital::holding::baud_index) == 2);
  Bytes question = hex("00 03 00 1D 00 01");
  LittleWriter(question).write(crc16_modbus(question));
  CHECK(sensor.query(question).empty());
}

TEST_CASE("a Modbus TCP request may come in pieces, however slowly within half a second") {
  AtiDigitalParams params;
  params.modbus_tcp = true;
  Sensor sensor(params);
  CHECK(sensor.query("12 34 00 00 00 06").empty());
  CHECK(sensor.query("0A 03 00 1D 00 01") == hex("12 34 00 00 00 05 0A 03 02 00 00"));
  CHECK(sensor.query("12 34 00 00 00 06 0A").empty());
  sensor.device.meet_new_host();
  CHECK(sensor.query("00 01 00 00 00 06 0A 03 00 1D 00 01").size() == 11);
  CHECK(sensor.query("00 01 00 00 00 05 0A 2B 0E 01 00") == hex("00 01 00 00 00 03 0A AB 01"));
}

}  // namespace ati_digital_emulator_test
