// The answers of an emulated APT stage, their receivers, and the messages that it ignores.

#include <catch2/catch.hpp>

#include "sim/plant/random.hpp"
#include "tests/unit/sim/apt_unit.hpp"

namespace apt_stage_emulator_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::protocols::apt;
using test::hex;
using test::Unit;

TEST_CASE("a stage sends its identity in 90 bytes and is silent otherwise") {
  Unit unit;
  unit.run(5);
  CHECK(unit.out.empty());
  unit.send("05 00 00 00 50 01");
  const Bytes reply = unit.take();
  REQUIRE(reply.size() == 90);
  CHECK(Bytes(reply.begin(), reply.begin() + 6) == hex("06 00 54 00 81 50"));
  const auto info = decode_body<HardwareInfo>(decode(reply)->data);
  CHECK(info->model.str() == "LTS150");
  CHECK(info->serial == 45000001);
  CHECK(Unit("PRM1-Z8").emulator.ignored() == 0);
}

TEST_CASE("any chunking of a conversation has the same effect") {
  const std::string client_session =
      "18 00 00 00 50 01 12 00 00 00 50 01 05 00 00 00 50 01 10 02 01 01 50 01 "
      "43 04 01 00 50 01 13 04 0E 00 D0 01 01 00 00 00 00 00 08 60 01 00 00 00 36 1A "
      "53 04 06 00 D0 01 01 00 00 C0 D4 01 80 04 01 00 50 01 14 04 01 00 50 01";
  Unit whole;
  whole.send(client_session);
  const Bytes expected = whole.take();
  REQUIRE(expected.size() == 90 + 20 + 20);
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    Unit cut;
    const Bytes bytes = hex(client_session);
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random.bits() % 9, bytes.size() - at);
      cut.send(Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                     bytes.begin() + static_cast<std::ptrdiff_t>(at + size)));
      at += size;
    }
    CHECK(cut.take() == expected);
  }
}

TEST_CASE("a unit with one channel answers at every address that hosts use, from there") {
  Unit unit;
  for (const char* address : {"50", "21", "11"}) {
    unit.send(std::string("05 00 00 00 ") + address + " 01");
    const Bytes reply = unit.take();
    REQUIRE(reply.size() == 90);
    CHECK(Bytes(reply.begin(), reply.begin() + 6) == hex(std::string("06 00 54 00 81 ") + address));
  }
  unit.send("60 00 00 00 11 01 60 00 01 00 11 01");
  CHECK(unit.take() == hex("61 00 00 01 01 11 61 00 01 02 01 11"));
}

TEST_CASE("a card answers at its bay, its rack at 0x11 with the rack's own info") {
  AptStageParams params = Unit::params("NRT150", RetargetPolicy::replan);
  params.model = "BSC203";
  params.bay = 1;
  BenchPlant bench_plant(test::stages_plant(), 1);
  AptStageEmulator card(params, bench_plant, {});
  Bytes out;
  ByteSink sink = [&](ByteView bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); };
  const auto query = [&](const std::string& text) {
    out.clear();
    card.receive(hex(text), {}, sink);
    return out;
  };
  const auto info = [&](const std::string& text) {
    return decode_body<HardwareInfo>(decode(query(text))->data).value();
  };
  CHECK(info("05 00 00 00 11 01").hardware_type == 45);
  CHECK(info("05 00 00 00 11 01").channels == 3);
  CHECK(info("05 00 00 00 22 01").hardware_type == 44);
  CHECK(info("05 00 00 00 22 01").channels == 1);
  CHECK(query("05 00 00 00 50 01").empty());
  CHECK(query("05 00 00 00 21 01").empty());
  CHECK(query("60 00 01 00 11 01") == hex("61 00 01 01 01 11"));
  CHECK(query("60 00 00 00 11 01") == hex("61 00 00 02 01 11"));
  CHECK(query("11 04 01 00 22 01") == hex("12 04 06 00 81 22 01 00 00 00 00 00"));
  CHECK(query("28 02 03 00 11 01 29 02 00 00 11 01") == hex("30 02 03 00 01 11"));
  CHECK(query("26 02 00 00 11 01") == hex("27 02 04 00 81 11 03 00 00 00"));
}

TEST_CASE("every parameter that is set is given back, and the database's defaults before") {
  Unit unit = Unit::at("BSC201", "LTS150");
  unit.send("3B 04 01 00 50 01");  // backlash 0.05 mm
  CHECK(unit.take() == hex("3C 04 06 00 81 50 01 00 00 50 00 00"));
  unit.send("41 04 01 00 50 01");  // homing 2 mm/s, offset 0.5 mm
  CHECK(unit.take() == hex("42 04 0E 00 81 50 01 00 02 00 01 00 00 00 9F 02 00 20 03 00"));
  for (const auto& [set, size] : {std::pair{0x0413, 14},
                                  {0x0416, 22},
                                  {0x0423, 16},
                                  {0x0426, 6},
                                  {0x043A, 6},
                                  {0x0440, 14},
                                  {0x0445, 6},
                                  {0x0450, 6},
                                  {0x04A0, 20},
                                  {0x04B0, 26},
                                  {0x04B3, 4},
                                  {0x04B6, 16},
                                  {0x04E3, 12},
                                  {0x04F4, 4},
                                  {0x0520, 28},
                                  {0x0523, 12},
                                  {0x0526, 34},
                                  {0x0529, 36}}) {
    Message message{
        static_cast<MessageId>(set), 0, 0, 0x50, 0x01, Bytes(static_cast<std::size_t>(size), 7)};
    unit.send(encode(message));
    CHECK(unit.take().empty());
    unit.send(encode(Message{static_cast<MessageId>(set + 1), 1, 0, 0x50, 0x01, {}}));
    const auto reply = decode(unit.take());
    REQUIRE(reply);
    CHECK(reply->id == static_cast<MessageId>(set + 2));
    CHECK(reply->data == message.data);
  }
  CHECK(unit.emulator.ignored() == 0);
}

TEST_CASE("noise on the line and messages for others do no harm") {
  Unit unit;
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    Bytes noise(1 + random.bits() % 64);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.bits());
    // Half of them have a plausible header.
    if (i % 2 == 0 && noise.size() > 6) {
      noise[1] = static_cast<std::uint8_t>(random.bits() % 6);
      noise[3] = 0;
      noise[4] = random.bits() % 2 == 0 ? 0x50 : 0xD0;
      noise[5] = 0x01;
    }
    unit.send(noise);
    unit.run(0.01);
  }
  unit.send(Bytes(600, 0));
  unit.take();
  CHECK(unit.position() >= 0);
  CHECK(unit.position() <= 0.15);
  unit.send("05 00 00 00 22 01");  // bay 1 is another unit
  CHECK(unit.take().empty());
  CHECK(unit.emulator.ignored() > 0);
}

TEST_CASE("a message to an unused address swallows none behind it") {
  const Bytes identify = hex("05 00 00 00 50 01");
  for (const int destination : {0x00, 0x01, 0x02, 0x22, 0x33, 0x51, 0x7F})
    for (const char* text : {"11 04 01 00 00 01", "23 02 01 00 00 01", "10 02 01 01 00 01",
                             "53 04 06 00 80 01 01 00 00 00 01 00"}) {
      CAPTURE(destination, text);
      Unit unit;
      Bytes misled = hex(text);
      misled[4] = static_cast<std::uint8_t>(misled[4] | destination);
      misled.insert(misled.end(), identify.begin(), identify.end());
      unit.send(misled);
      CHECK(unit.take().size() == 90);
      unit.run(1);
      CHECK(unit.position() == 0.02);
    }
}

TEST_CASE("half a message of a host that went is not the beginning of another's") {
  Unit unit;
  unit.ready();
  unit.send("53 04 06 00 D0 01 01 00");  // four bytes of a position are missing
  unit.run(1);
  unit.send("05 00 00 00 50 01");
  CHECK(unit.take().size() == 90);
  unit.run(5);
  CHECK(unit.position() == Approx(0).margin(1e-9));  // and it has not moved
  unit.send("53 04 06 00 D0 01 01 00");
  unit.run(0.1);
  unit.send("00 C0 D4 01");  // the rest from a slow host
  unit.run(20);
  CHECK(unit.take().size() == 20);
  // on TCP the rig notices a new host at once
  unit.send("53 04 06 00 D0 01 01 00");
  unit.emulator.meet_new_host();
  unit.send("05 00 00 00 50 01");
  CHECK(unit.take().size() == 90);
}

TEST_CASE("a message of another length than documented, or unknown, is taken whole and ignored") {
  // Bodies that contain a request, in case they are searched for one.
  const Bytes inside = hex("05 00 00 00 50 01 05 00 00 00 50 01");
  for (const int id : {0x0413, 0x0443, 0x0005, 0x0999, 0x0A00, 0x0522}) {
    Unit unit;
    Bytes data = inside;
    data.resize(200, 0x50);
    for (const std::size_t size : {200U, 12U}) {
      data.resize(size);
      const auto before = unit.emulator.ignored();
      unit.send(encode(Message{static_cast<MessageId>(id), 0, 0, 0x50, 0x01, data}));
      CHECK(unit.emulator.ignored() == before + 1);
      CHECK(unit.take().empty());
      unit.send("05 00 00 00 50 01");
      CHECK(unit.take().size() == 90);
    }
  }
}

TEST_CASE("a K-cube's panel and triggers are sent in one length, whatever the host's issue sets") {
  Unit unit("PRM1-Z8");
  unit.send("21 05 01 00 50 01");  // the wheel: velocity mode, 10 deg/s, 10 deg/s2, upwards is
                                   // forward
  CHECK(unit.take() == hex("22 05 1C 00 81 50 01 00 01 00 69 8D 06 00 93 00 00 00 01 00 "
                           "00 00 00 00 00 00 00 00 32 00 0A 00 02 00"));
  const auto saved = [&](std::uint16_t set, std::size_t size) {
    Bytes data(size, 0);
    for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<std::uint8_t>(i + 1);
    unit.send(encode(Message{static_cast<MessageId>(set), 0, 0, 0x50, 0x01, data}));
    unit.send(encode(Message{static_cast<MessageId>(set + 1), 1, 0, 0x50, 0x01, {}}));
    const Bytes reported = decode(unit.take()).value().data;
    const std::size_t same = std::min(size, reported.size());
    CHECK(std::equal(reported.begin(), reported.begin() + static_cast<std::ptrdiff_t>(same),
                     data.begin()));
    return reported.size();
  };
  CHECK(saved(0x0520, 36) == 28);  // including the eight bytes of the BBD30x
  CHECK(saved(0x0520, 28) == 28);
  for (const std::size_t size : {10U, 12U, 22U}) CHECK(saved(0x0523, size) == 12);
  for (const std::size_t size : {28U, 36U}) CHECK(saved(0x0529, size) == 36);
}

TEST_CASE("a cube reports that it is on no hub; outputs are given back, inputs read nothing") {
  Unit cube("PRM1-Z8");
  cube.send("65 00 00 00 50 01");
  CHECK(cube.take() == hex("66 00 FF 00 01 50"));
  cube.send("13 02 05 00 50 01 14 02 00 00 50 01");
  CHECK(cube.take() == hex("15 02 05 00 01 50"));
  cube.send("2B 04 01 00 50 01");
  CHECK(cube.take() == hex("2C 04 04 00 81 50 00 00 00 00"));
  cube.send("26 02 00 00 11 01 29 02 00 00 11 01");  // messages of racks
  CHECK(cube.take().empty());
  Unit stage;
  stage.send("65 00 00 00 50 01 14 02 00 00 50 01 2B 04 01 00 50 01");
  CHECK(stage.take().empty());
  CHECK(stage.emulator.ignored() == 3);
}

}  // namespace apt_stage_emulator_test
